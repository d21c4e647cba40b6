"""The plugin on the bench: what is said is heard again."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from nondum.sdk import WorkerFailed
from nondum_speech.espeak import Espeak

PLUGIN = "nondum_speech.plugin:Speech"
WORDS = {
    "phrases": ["[please] follow {class}", "[please] point at {target}"],
    "names": {"class": ["people", "quadrotors"], "target": ["radiation source", "дом"]},
}
Say = Callable[[str], Path]


@pytest.fixture
def bench(worker: Any, tmp_path: Path) -> Any:
    """A machine without a sound card: files in, files out."""
    settings = {"microphone": "", "inbox": str(tmp_path / "in"), "said": str(tmp_path / "out")}
    return worker(PLUGIN, settings=settings)


@pytest.fixture
def say(bench: Any, tmp_path: Path) -> Say:
    """Have the plugin say something; gives the WAV file of it."""

    def said(text: str) -> Path:
        before = set((tmp_path / "out").glob("*.wav"))
        bench.ask("speak", text=text)
        (file,) = set((tmp_path / "out").glob("*.wav")) - before
        return file

    return said


def test_spoken_sentence_is_recognised(bench: Any, say: Say, tmp_path: Path) -> None:
    said = say("Please point at the radiation source.")
    bench.ask("learn_words", vocabulary=WORDS)
    said.rename(tmp_path / "in" / "one.wav")
    assert bench.ask("listen") == {"words": "please point at the radiation source"}
    assert [path.name for path in (tmp_path / "in").iterdir()] == ["one.wav.heard"]


def test_file_that_cannot_be_marked_is_reported_and_the_next_is_recognised(
    bench: Any, say: Say, tmp_path: Path
) -> None:
    bench.ask("learn_words", vocabulary=WORDS)
    (tmp_path / "in" / "one.wav.heard").mkdir()
    say("Follow quadrotors.").rename(tmp_path / "in" / "one.wav")
    say("Follow people.").rename(tmp_path / "in" / "two.wav")
    assert bench.ask("listen") == {"words": "follow people"}


def test_file_that_comes_before_the_vocabulary_waits(bench: Any, say: Say, tmp_path: Path) -> None:
    say("Follow people.").rename(tmp_path / "in" / "one.wav")
    bench.ask("learn_words", vocabulary=WORDS)
    assert bench.ask("listen") == {"words": "follow people"}


def test_other_words_are_refused_and_told(bench: Any, say: Say, tmp_path: Path) -> None:
    bench.ask("learn_words", vocabulary=WORDS)
    say("The weather will be fine tomorrow.").rename(tmp_path / "in" / "1.wav")
    (tmp_path / "in" / "2.wav").write_bytes(b"no sound")
    os.utime(tmp_path / "in" / "2.wav", (0, 0))
    bench.ask("learn_words", vocabulary={**WORDS, "phrases": ["follow {class}"]})
    say("Follow people.").rename(tmp_path / "in" / "3.wav")
    assert bench.ask("listen") == {"words": "follow people"}
    logs = [message for _, message in bench.logs]
    assert any("of no known sentence" in message for message in logs)
    assert any(message.startswith("2.wav cannot be heard") for message in logs)


def test_words_of_no_dictionary_are_told(bench: Any) -> None:
    bench.ask("learn_words", vocabulary=WORDS)
    logs = [message for _, message in bench.logs]
    assert "in no dictionary, pronounced by rule: quadrotors" in logs
    assert "phrases and names with these words cannot be heard: дом" in logs


def test_files_of_sentences_are_counted_on(worker: Any, bench: Any, tmp_path: Path) -> None:
    bench.ask("speak", text="One.")
    bench.stop()
    again = worker(PLUGIN, settings={"microphone": "", "said": str(tmp_path / "out")})
    again.ask("speak", text="Two.")
    names = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert names == ["said-000001.wav", "said-000002.wav"]


@pytest.mark.parametrize(
    "settings",
    [{"voice": "klingonese"}, {"words_per_minute": 5}, {"confidence": 1}, {"mic": "default"}],
    ids=["voice", "speed", "confidence", "unknown"],
)
def test_wrong_settings_refuse_the_component(worker: Any, settings: dict[str, object]) -> None:
    with pytest.raises(WorkerFailed, match="SETTING_INVALID"):
        worker(PLUGIN, settings=settings)


def test_microphone_is_listened_to_and_the_own_voice_is_not(
    worker: Any, espeak: Espeak, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Programs stand for arecord and paplay: the one records what the other plays."""
    sound = espeak.say("follow people", voice="en-us", words_per_minute=160)
    # So much silence that the voice is through all pipes when its player ends.
    (tmp_path / "voice").write_bytes(sound.to_bytes() + bytes(1_000_000))
    os.mkfifo(tmp_path / "sound")
    program(tmp_path / "arecord", f'test "$3" = mic && exec cat <> {tmp_path}/sound')
    program(tmp_path / "paplay", f"cat > /dev/null; exec cat {tmp_path}/voice > {tmp_path}/sound")
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv("PULSE_SERVER", "unix:/nowhere")
    bench = worker(PLUGIN, settings={"microphone": "mic"})
    bench.ask("learn_words", vocabulary=WORDS)
    bench.ask("speak", text="It says: follow people.")
    said = espeak.say("point at the radiation source", voice="en-us", words_per_minute=160)
    with (tmp_path / "sound").open("wb") as pipe:
        pipe.write(bytes(64_000) + said.to_bytes() + bytes(64_000))
    assert bench.ask("listen") == {"words": "point at the radiation source"}


def program(path: Path, script: str) -> None:
    path.write_text(f"#!/bin/sh\n{script}\n", encoding="utf-8")
    path.chmod(0o755)

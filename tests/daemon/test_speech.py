"""The speech payload on a real host: a recording becomes a goal, and what is told a recording."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from demo.drives import build
from tests.kit.beacon import BEACON
from tests.kit.payloads import Part
from tests.kit.running_host import READY_S, Row, RunningHost
from tests.kit.until import until

from nondum.planning.words.asking import ASKED
from nondum.planning.words.stop_words import STOPS

pytestmark = pytest.mark.daemon

PLUGINS = Path(__file__).parents[2] / "plugins"


@pytest.fixture
def drive(tmp_path: Path) -> Path:
    """A drive with the payload, as `nondum payload build` makes it, for a machine without sound:
    recordings are put into its scratch folder, and found there, since it can reach no other."""
    plugin = tmp_path / "speech"
    shutil.copytree(PLUGINS / "speech", plugin)
    with (plugin / "payload.toml").open("a", encoding="utf-8") as manifest:
        manifest.write('\n[component.settings]\nmicrophone = ""\ninbox = "in"\nsaid = "out"\n')
    return build(
        [plugin], libraries=[PLUGINS / "sdk", PLUGINS / "espeak"], cache=tmp_path / "cache"
    )["speech"]


def test_spoken_goal_is_reached_and_told_aloud(
    host: RunningHost, drive: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for folder in ("espeak", "speech"):
        monkeypatch.syspath_prepend(PLUGINS / folder)
    from nondum_speech.espeak import Espeak
    from nondum_speech.grammar import Vocabulary
    from nondum_speech.lexicon import lexicon
    from nondum_speech.recogniser import FreeHearing, Limits, Recogniser
    from nondum_speech.sentences import sentences_of
    from nondum_speech.sound import read_wav

    espeak = Espeak(tmp_path)
    host.plug(drive)
    host.until_component("speech", "ready")
    host.bring("beacon", Part("beacon", BEACON))
    (scratch,) = host.state.glob("scratch/*/speech")
    until_logged(host, f"{2 + 2 * len(STOPS) + len(ASKED)} phrases can be heard")

    def say(text: str) -> None:
        sound = espeak.say(text, voice="en-us", words_per_minute=150)
        (scratch / "unfinished").write_bytes(sound.to_wav())
        (scratch / "unfinished").rename(scratch / "in" / f"{text}.wav")

    say("the weather is fine today")
    say("what can you do")
    host.until_told("I can greet people and shine.")
    said_before = set((scratch / "out").iterdir())
    say("greet people")
    host.until_told("speech heard 'greet people': that is goal")
    host.until("the goal is reached", greeted, timeout_s=READY_S)
    assert not any("weather" in goal["text"] for goal in host.view["goals"])

    said = Vocabulary(("speech heard greet people that is goal one", "speech is active"))
    words = lexicon(said.words, lambda word, voice: espeak.phonemes(word, voice=voice))
    recogniser = Recogniser(said, words, FreeHearing(), Limits(-0.85, -0.85))

    heard: dict[Path, bool] = {}

    def repeated(_view: object) -> bool:
        for file in {*(scratch / "out").glob("*.wav")} - said_before - {*heard}:
            sentences = sentences_of(read_wav(file))  # hearing takes longer than saying
            heard[file] = any(recogniser.hear(one).said == said.phrases[0] for one in sentences)
        return any(heard.values())

    host.until("the answer was said", repeated, timeout_s=READY_S)


def greeted(view: Row) -> bool:
    return any((goal["text"], goal["holds"]) == ("greet people", True) for goal in view["goals"])


def until_logged(host: RunningHost, words: str) -> None:
    """Wait until the payload has written something; nothing tells of that."""

    def messages() -> list[str]:
        return [row["message"] for row in host.ask("logs", component="speech")]

    until(f"logged: {words}", lambda: words in messages(), evidence=messages)

"""The speaker on the bench, with programs that stand in for espeak-ng and aplay."""

from __future__ import annotations

import asyncio
import os
from pathlib import Path
from typing import Any

import pytest

from nondum.sdk import WorkerFailed
from nondum_speaker.voice import Voice, find_voice

PLUGIN = "nondum_speaker.plugin"


def program(folder: Path, name: str, script: str) -> Path:
    path = folder / name
    path.write_text(f"#!/bin/sh\n{script}\n", encoding="utf-8")
    path.chmod(0o755)
    return path


@pytest.fixture
def silent(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A machine without a voice."""
    monkeypatch.setenv("PATH", str(tmp_path))


@pytest.mark.usefixtures("silent")
def test_report_is_printed_where_nothing_can_be_heard(worker: Any) -> None:
    bench = worker(PLUGIN, settings={"report": "There is a {thing}!"})
    bench.behave("report", u="voice", c="traffic-cone", h=bench.host).assert_succeeded()
    said = [message for _, message in bench.logs]
    assert "says: There is a traffic cone!" in said
    assert any("espeak-ng is not here" in message for message in said)


@pytest.mark.usefixtures("silent")
def test_host_may_say_anything(worker: Any) -> None:
    bench = worker(PLUGIN)
    bench.ask("speak", text="Safe to remove.")
    assert ("info", "says: Safe to remove.") in [(level.lower(), m) for level, m in bench.logs]


@pytest.mark.parametrize(
    "settings", [{"report": "{name}"}, {"words_per_minute": 5}], ids=["template", "speed"]
)
def test_wrong_settings_refuse_the_component(worker: Any, settings: dict[str, object]) -> None:
    with pytest.raises(WorkerFailed, match="SETTING_INVALID"):
        worker(PLUGIN, settings=settings)


def say(voice: Voice, text: str) -> bool:
    return asyncio.run(voice.say(text, language="en", words_per_minute=160))


def test_text_is_spoken_and_played(tmp_path: Path) -> None:
    heard = tmp_path / "heard"
    espeak = program(tmp_path, "espeak-ng", 'printf "%s|" "$@"; cat')
    aplay = program(tmp_path, "aplay", f"cat > {heard}")
    assert say(Voice(str(espeak), (str(aplay),)), "--hello")
    assert heard.read_text().endswith("|--hello")


def test_program_that_fails_is_not_taken_for_speech(tmp_path: Path) -> None:
    broken = program(tmp_path, "espeak-ng", "exit 3")
    assert not say(Voice(str(broken), ("true",)), "hello")
    assert not say(Voice("/no/such/program", ("true",)), "hello")


def test_cancelled_speech_leaves_nothing_running(tmp_path: Path) -> None:
    started = tmp_path / "started"
    os.mkfifo(started)
    slow = program(tmp_path, "espeak-ng", f"echo yes > {started}; exec sleep 60")

    async def interrupted() -> None:
        speech = asyncio.create_task(
            Voice(str(slow), ("true",)).say("hello", language="en", words_per_minute=160)
        )
        await asyncio.to_thread(started.read_text)
        speech.cancel()
        with pytest.raises(asyncio.CancelledError):
            await asyncio.wait_for(speech, 5)

    asyncio.run(interrupted())


def test_player_is_chosen_by_what_there_is(tmp_path: Path) -> None:
    for name in ("espeak-ng", "aplay", "paplay"):
        program(tmp_path, name, "")
    sound = tmp_path / "snd"
    sound.mkdir()
    path = {"PATH": str(tmp_path)}
    assert find_voice(path, sound).player is None
    (sound / "pcmC0D0p").touch()
    assert find_voice(path, sound).player == (str(tmp_path / "aplay"), "-q", "-")
    server = find_voice({**path, "PULSE_SERVER": "unix:/x"}, sound)
    assert server.player == (str(tmp_path / "paplay"),)
    assert server.synthesiser == str(tmp_path / "espeak-ng")

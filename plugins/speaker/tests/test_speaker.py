"""The speaker on the bench."""

from __future__ import annotations

import wave
from pathlib import Path
from typing import Any

import pytest

from nondum.sdk import WorkerFailed

PLUGIN = "nondum_speaker.plugin:Speaker"


@pytest.fixture
def silent(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A machine without a sound player."""
    monkeypatch.setenv("PATH", str(tmp_path))


def report(bench: Any) -> Any:
    return bench.behave("report", u="voice", c="traffic-cone", h=bench.host)


@pytest.mark.usefixtures("silent")
def test_report_is_printed_without_a_sound_player(worker: Any) -> None:
    bench = worker(PLUGIN, settings={"report": "There is a {thing}!"})
    report(bench).assert_succeeded()
    said = [message for _, message in bench.logs]
    assert "says: There is a traffic cone!" in said
    assert any("no sound player is here" in message for message in said)


def test_report_is_spoken_into_a_file(worker: Any, tmp_path: Path) -> None:
    bench = worker(PLUGIN, settings={"said": str(tmp_path / "out")})
    report(bench).assert_succeeded()
    (file,) = (tmp_path / "out").iterdir()
    with wave.open(str(file)) as wav:
        assert 1 < wav.getnframes() / wav.getframerate() < 4


@pytest.mark.usefixtures("silent")
def test_host_may_say_anything(worker: Any) -> None:
    bench = worker(PLUGIN)
    bench.ask("speak", text="Safe to remove.")
    assert ("info", "says: Safe to remove.") in [(level.lower(), m) for level, m in bench.logs]


def test_voice_that_fails_is_no_failure_of_the_behaviour(
    worker: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "paplay").write_text("#!/bin/sh\nexit 3\n", encoding="utf-8")
    (tmp_path / "paplay").chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setenv("PULSE_SERVER", "unix:/nowhere")
    bench = worker(PLUGIN)
    report(bench).assert_succeeded()
    assert any("that was not heard" in message for _, message in bench.logs)


@pytest.mark.parametrize(
    "settings",
    [{"report": "{name}"}, {"words_per_minute": 5}, {"voice": "klingonese"}],
    ids=["template", "speed", "voice"],
)
def test_wrong_settings_refuse_the_component(worker: Any, settings: dict[str, object]) -> None:
    with pytest.raises(WorkerFailed, match="SETTING_INVALID"):
        worker(PLUGIN, settings=settings)

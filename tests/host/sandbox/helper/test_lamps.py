"""Lamps: a folder that is like the kernel's LED class, but that nothing in it blinks."""

from __future__ import annotations

from pathlib import Path

import pytest

from nondum.host.core.feedback_state import State
from nondum.host.sandbox.helper.lamp_patterns import PATTERNS
from nondum.host.sandbox.helper.lamps import Lamps
from nondum.sdk.errors import InstallFailed

KNOWN = "none [kbd-capslock] timer heartbeat"


@pytest.fixture
def leds(tmp_path: Path) -> Path:
    folder = tmp_path / "leds"
    for name in ("input3::capslock", "input3::numlock", "ACT"):
        lamp(folder, name)
    return folder


def lamp(leds: Path, name: str, triggers: str = KNOWN, brightness: str = "0") -> Path:
    folder = leds / name
    folder.mkdir(parents=True)
    for file, text in (
        *(("trigger", triggers), ("brightness", brightness), ("max_brightness", "255")),
        *(("delay_on", "500"), ("delay_off", "500")),
    ):
        (folder / file).write_text(f"{text}\n")
    return folder


def said(leds: Path, name: str) -> dict[str, str]:
    return {file.name: file.read_text().strip() for file in (leds / name).iterdir()}


def chosen(tmp_path: Path, *names: str) -> Lamps:
    return Lamps(names, tmp_path / "run/lamps.json", tmp_path / "leds")


def kernel(leds: Path, name: str) -> None:
    """Show the trigger as the kernel does, with all that there are."""
    current = (leds / name / "trigger").read_text().strip()
    (leds / name / "trigger").write_text(f"none timer heartbeat [{current}]\n")


def test_no_two_states_look_alike() -> None:
    assert set(PATTERNS) == set(State)
    assert len(set(PATTERNS.values())) == len(State)


def test_a_ready_host_lights_its_lamp(leds: Path, tmp_path: Path) -> None:
    chosen(tmp_path, "ACT").show(State.READY)
    assert (said(leds, "ACT")["trigger"], said(leds, "ACT")["brightness"]) == ("none", "255")


@pytest.mark.parametrize("state", [s for s, p in PATTERNS.items() if p.trigger == "timer"])
def test_the_kernel_is_told_how_to_blink(leds: Path, tmp_path: Path, state: State) -> None:
    chosen(tmp_path, "ACT").show(state)
    told, pattern = said(leds, "ACT"), PATTERNS[state]
    assert told["trigger"] == "timer"
    assert (told["delay_on"], told["delay_off"]) == (str(pattern.on_ms), str(pattern.off_ms))


def test_other_lamps_are_left_alone(leds: Path, tmp_path: Path) -> None:
    chosen(tmp_path, "*::capslock").show(State.HELP)
    assert said(leds, "input3::capslock")["trigger"] == "heartbeat"
    assert said(leds, "ACT")["trigger"] == KNOWN


def test_at_the_end_it_shows_what_it_showed_before(leds: Path, tmp_path: Path) -> None:
    lamps = chosen(tmp_path, "ACT")
    lamps.show(State.READY)
    lamps.end()
    assert said(leds, "ACT")["trigger"] == "kbd-capslock"
    assert not lamps.kept.exists()


def test_next_daemon_after_a_killed_one_knows_what_the_lamp_showed(
    leds: Path, tmp_path: Path
) -> None:
    lamp(leds, "PWR", "[none] timer heartbeat", brightness="7")
    chosen(tmp_path, "PWR").show(State.WORKING)
    kernel(leds, "PWR")
    chosen(tmp_path, "PWR").show(State.REFUSED)
    chosen(tmp_path, "PWR").end()
    assert (said(leds, "PWR")["trigger"], said(leds, "PWR")["brightness"]) == ("none", "7")


def test_a_missing_lamp_is_told_and_the_rest_is_lit(leds: Path, tmp_path: Path) -> None:
    with pytest.raises(InstallFailed) as refused:
        chosen(tmp_path, "no-such", "ACT").show(State.READY)
    assert [problem.code for problem in refused.value.problems] == ["LAMP_MISSING"]
    assert "input3::numlock" in str(refused.value)
    assert said(leds, "ACT")["brightness"] == "255"


def test_a_kernel_that_cannot_blink_is_told(leds: Path, tmp_path: Path) -> None:
    lamp(leds, "old", "[none] mmc0", brightness="255")
    with pytest.raises(InstallFailed) as refused:
        chosen(tmp_path, "old").show(State.REFUSED)
    assert refused.value.code == "LAMP_TRIGGER"
    assert said(leds, "old")["brightness"] == "0"


def test_names_never_leave_the_folder(leds: Path, tmp_path: Path) -> None:
    outside = lamp(tmp_path / "elsewhere", "ACT")
    with pytest.raises(InstallFailed):
        chosen(tmp_path, "../elsewhere/ACT").show(State.READY)
    assert (outside / "brightness").read_text() == "0\n"


@pytest.mark.parametrize("kept", ["", "[]", "{", '{"ACT": 1}'])
def test_a_file_that_was_cut_short_is_passed_over(leds: Path, tmp_path: Path, kept: str) -> None:
    lamps = chosen(tmp_path, "ACT")
    lamps.kept.parent.mkdir()
    lamps.kept.write_text(kept)
    lamps.show(State.READY)
    lamps.end()
    assert said(leds, "ACT")["trigger"] == "kbd-capslock"

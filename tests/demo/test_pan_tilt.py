"""The emulated unit speaks as the PTU-D46's manual shows, and moves as motors do."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from demo.emulators.axis import Axis
from demo.emulators.pan_tilt import PanTiltUnit

TICK_S = 0.01


def terse() -> PanTiltUnit:
    unit = PanTiltUnit()
    unit.receive(b"ED FT ")
    return unit


def said(unit: PanTiltUnit, command: str) -> str:
    return unit.receive(f"{command} ".encode()).decode().strip()


def late(unit: PanTiltUnit, *, within_s: float = 60.0) -> tuple[str, float]:
    """The next thing it says by itself, and after how long."""
    for tick in range(int(within_s / TICK_S)):
        if answer := unit.advance(TICK_S):
            return answer.decode().strip(), tick * TICK_S
    raise AssertionError("it said nothing")


@pytest.mark.parametrize(
    ("command", "expected"),
    [
        ("PP", "PP * Current Pan position is 0"),
        ("PR", "PR * 185.1428 seconds arc per position"),
        ("PN", "PN * Minimum Pan position is -3090"),
        ("TX", "TX * Maximum Tilt position is 604"),
        ("PU", "PU * Maximum Pan speed is 2902 positions/sec"),
        ("PA", "PA * Pan acceleration is 2000 positions/sec^2"),
        ("L", "L * Limit bounds are ENABLED (soft limits enabled)"),
        ("PP3200", "PP3200 ! Maximum allowable Pan position is 3090"),
        ("PS3300", "PS3300 ! Pan speed cannot exceed 2902 positions/sec"),
        ("PS20", "PS20 ! Motor speed cannot be less than 31 pos/sec"),
        ("XYZZY", "XYZZY ! Illegal command entered: XYZZY"),
    ],
)
def test_the_manuals_dialogue_is_kept(command: str, expected: str) -> None:
    assert said(PanTiltUnit(), command) == expected


def test_terse_and_unechoed_answers_are_short() -> None:
    unit = terse()
    assert said(unit, "pp") == "* 0"
    assert said(unit, "PP100") == "*"
    assert said(unit, "F") == "* ASCII terse mode"


def test_carriage_returns_end_commands_and_line_feeds_do_not() -> None:
    assert terse().receive(b"P\nP\rTP\r") == b"* 0\r\n* 0\r\n"


def test_a_command_may_come_in_pieces() -> None:
    unit = terse()
    assert unit.receive(b"P") == b""
    assert unit.receive(b"P ") == b"* 0\r\n"


def test_await_is_answered_when_the_head_is_there() -> None:
    unit = terse()
    assert unit.receive(b"PP1000 A PP ") == b"*\r\n"
    answer, seconds = late(unit)
    assert answer == "*\r\n* 1000"
    assert seconds == pytest.approx(1.0, abs=0.05)


def test_slaved_moves_wait_for_await() -> None:
    unit = terse()
    unit.receive(b"S PP100 TP-50 ")
    assert unit.advance(1.0) == b""
    assert unit.pan.position == 0
    unit.receive(b"A ")
    late(unit)
    assert (unit.pan.position, unit.tilt.position) == (100, -50)


def test_halt_stops_where_it_is() -> None:
    unit = terse()
    unit.receive(b"PP3000 ")
    unit.advance(0.5)
    unit.receive(b"H ")
    unit.advance(5.0)
    assert unit.pan.position == pytest.approx(500, abs=5)


def test_limits_can_be_disabled_for_larger_ranges() -> None:
    assert said(terse(), "TP-1000").startswith("! Minimum allowable Tilt position is -907")
    unit = terse()
    unit.receive(b"LD ")
    assert said(unit, "TP-1000") == "*"


def test_reset_hits_all_ends_and_comes_home() -> None:
    unit = PanTiltUnit(pan_rad=1.0, tilt_rad=-0.3)
    unit.receive(b"ED FT R ")
    answer, _ = late(unit)
    assert answer == "!T!T!P!P*"
    assert (unit.pan.position, unit.tilt.position) == (0, 0)


def test_fast_moves_accelerate_and_brake() -> None:
    axis = Axis("Pan", -3090, 3090, speed=2900, target=3000)
    speeds = []
    while axis.is_moving:
        before = axis.position
        axis.advance(TICK_S)
        speeds.append((axis.position - before) / TICK_S)
    assert max(speeds) > 2000
    assert max(speeds) <= 2900
    steps = [abs(b - a) / TICK_S for a, b in pairwise(speeds[:-1])]
    assert max(steps) <= axis.acceleration * 1.1
    assert axis.position == 3000


def test_a_target_may_change_on_the_fly() -> None:
    axis = Axis("Pan", -3090, 3090, speed=2900, target=3000)
    axis.advance(0.8)
    axis.target = -500
    axis.advance(10)
    assert axis.position == -500


def test_it_starts_where_it_was_left() -> None:
    unit = PanTiltUnit(pan_rad=0.5, tilt_rad=-0.2)
    assert unit.pan.angle_rad == pytest.approx(0.5, abs=math.radians(0.03))
    assert unit.tilt.angle_rad == pytest.approx(-0.2, abs=math.radians(0.03))


def test_a_seized_head_counts_steps_and_stays() -> None:
    unit = PanTiltUnit(pan_rad=0.5)
    unit.seize()
    unit.receive(b"ED FT PP-500 ")
    unit.advance(10)
    assert said(unit, "PP") == "* -500"
    assert unit.pan.angle_rad == pytest.approx(0.5, abs=math.radians(0.03))

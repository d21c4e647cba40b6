"""The unicycle."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum_mobile_base.unicycle import Command, Limits, Motion, moved

LIMITS = Limits()
DT = 0.05
speeds = st.floats(-5, 5)


def driven(seconds: float, command: Command, motion: Motion | None = None) -> Motion:
    """The motion after a command that is repeated all the time."""
    motion = motion or Motion()
    for step in range(round(seconds / DT)):
        now = step * DT
        fresh = Command(now, command.speed_m_s, command.turn_rad_s)
        motion = moved(motion, fresh, now_s=now, dt_s=DT, limits=LIMITS)
    return motion


def test_straight_command_drives_straight() -> None:
    motion = driven(5.0, Command(0, 0.5, 0.0))
    assert motion.x == pytest.approx(0.5 * 5 - 0.5 * 0.5 / 2, abs=0.02)
    assert (motion.y, motion.heading) == (0.0, 0.0)


def test_positive_turn_is_to_the_left() -> None:
    motion = driven(2.0, Command(0, 0.5, 0.5))
    assert motion.heading > 0
    assert motion.y > 0


def test_circle_closes() -> None:
    start = driven(1.0, Command(0, 0.5, 0.5))
    end = driven(2 * math.pi / 0.5, Command(0, 0.5, 0.5), start)
    assert math.dist((start.x, start.y), (end.x, end.y)) < 0.05


@pytest.mark.parametrize("age_s", [0.31, 1.0])
def test_command_past_its_deadline_brakes(age_s: float) -> None:
    motion = Motion(speed_m_s=0.5, turn_rad_s=1.0)
    command = Command(0.0, 0.5, 1.0)
    for step in range(20):
        now = age_s + step * DT
        motion = moved(motion, command, now_s=now, dt_s=DT, limits=LIMITS)
    assert motion.is_still


def test_without_a_command_it_stands() -> None:
    assert moved(Motion(), None, now_s=0, dt_s=DT, limits=LIMITS) == Motion()


@given(st.lists(st.tuples(speeds, speeds), min_size=1, max_size=60))
def test_limits_hold_whatever_is_commanded(commands: list[tuple[float, float]]) -> None:
    motion = Motion()
    for step, (speed, turn) in enumerate(commands):
        before, now = motion, step * DT
        motion = moved(motion, Command(now, speed, turn), now_s=now, dt_s=DT, limits=LIMITS)
        assert -LIMITS.reverse_m_s <= motion.speed_m_s <= LIMITS.speed_m_s
        assert abs(motion.turn_rad_s) <= LIMITS.turn_rad_s
        gained = abs(motion.speed_m_s - before.speed_m_s)
        assert gained <= LIMITS.acceleration_m_s2 * DT + 1e-9


def test_limits_without_brakes_are_refused() -> None:
    with pytest.raises(ValueError, match="acceleration_m_s2"):
        Limits(acceleration_m_s2=0)

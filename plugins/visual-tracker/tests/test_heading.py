"""Which way the body faced when."""

from __future__ import annotations

import math

import pytest

from nondum_visual_tracker.heading import Heading


def test_body_that_was_never_told_to_turn_stands() -> None:
    assert Heading().at(5.0) == 0.0


def test_odometry_is_read_between_its_samples() -> None:
    heading = Heading()
    heading.measured(1.0, 2.0)
    heading.measured(1.1, 2.2)
    assert heading.at(1.05) - heading.at(1.0) == pytest.approx(0.1)


def test_odometry_does_not_wrap() -> None:
    heading = Heading()
    for step in range(40):
        yaw = math.remainder(0.3 * step, math.tau)
        heading.measured(0.1 * step, yaw)
    assert heading.at(3.9) - heading.at(0.0) == pytest.approx(0.3 * 39)


def test_commands_stand_in_for_odometry() -> None:
    heading = Heading()
    for step in range(11):
        heading.commanded(0.1 * step, 0.5)
    assert heading.at(1.0) == pytest.approx(0.5)


def test_commands_are_ignored_while_odometry_speaks() -> None:
    heading = Heading()
    for step in range(11):
        heading.measured(0.1 * step, 1.0)
        heading.commanded(0.1 * step + 0.01, 0.5)
    assert heading.at(1.0) == pytest.approx(heading.at(0.0))


def test_odometry_that_comes_later_takes_over_without_a_jump() -> None:
    heading = Heading()
    for step in range(11):
        heading.commanded(0.1 * step, 0.5)
    before = heading.at(1.05)
    heading.measured(1.05, -2.0)
    assert heading.at(1.05) == pytest.approx(before)
    heading.measured(1.15, -1.9)
    assert heading.at(1.15) == pytest.approx(before + 0.1)


def test_commands_carry_on_when_odometry_stalls() -> None:
    heading = Heading()
    heading.measured(0.0, 1.0)
    heading.measured(0.1, 1.0)
    for step in range(20):
        heading.commanded(0.1 + 0.1 * step, 0.5)
    assert heading.at(2.0) > heading.at(0.1) + 0.3

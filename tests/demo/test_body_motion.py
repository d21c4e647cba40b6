"""Standing and turning, by odometry."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest
from demo.body_motion import Motion, motion

STEP_S = 0.05


def moved(
    heading: Callable[[float], float],
    x: Callable[[float], float] = lambda t: 0.0,
    *,
    begin_s: float = 1.0,
    end_s: float = 5.0,
) -> Motion | None:
    """How a body moves whose odometry covers six seconds."""
    stamps = [step * STEP_S for step in range(121)]
    headings = [(t, math.remainder(heading(t), math.tau)) for t in stamps]
    return motion(headings, [(t, x(t), 0.0) for t in stamps], begin_s, end_s)


def test_body_that_stands_stands() -> None:
    found = moved(lambda t: 1.0)
    assert found is not None
    assert found.is_still


def test_braking_before_the_stretch_does_not_count() -> None:
    found = moved(lambda t: min(t, 1.0), lambda t: min(t, 1.0))
    assert found is not None
    assert found.is_still


@pytest.mark.parametrize(
    ("heading", "x"),
    [
        (lambda t: 0.02 * t, lambda t: 0.0),
        (lambda t: 0.0, lambda t: 0.02 * t),
        (lambda t: max(0.0, t - 4.5) * 0.44, lambda t: 0.0),
    ],
    ids=["turns", "drives", "searches later"],
)
def test_body_that_moves_does_not_stand(
    heading: Callable[[float], float], x: Callable[[float], float]
) -> None:
    found = moved(heading, x)
    assert found is not None
    assert not found.is_still


def test_turning_past_half_a_turn_is_no_jump() -> None:
    found = moved(lambda t: 3.0 + 0.1 * t)
    assert found is not None
    assert found.turned_rad == pytest.approx(0.4)


@pytest.mark.parametrize(("begin_s", "end_s"), [(-1.0, 5.0), (1.0, 7.0)])
def test_a_stretch_that_odometry_does_not_cover_is_not_judged(begin_s: float, end_s: float) -> None:
    assert moved(lambda t: 0.0, begin_s=begin_s, end_s=end_s) is None
    assert motion([], [], begin_s, end_s) is None

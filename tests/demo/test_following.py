"""The score of following: what passes, and what must not."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import pytest
from demo.following import WANTED_FRACTION, Reference, errors, score_following

DATA = Path(__file__).parents[2] / "plugins" / "panorama" / "nondum_panorama" / "data"
REFERENCE = Reference.read(DATA / "pedestrians.toml")
FIRST, LAST = min(REFERENCE.azimuths), max(REFERENCE.azimuths)
HOLD_S, REST = 3.0, 10
RATE_HZ = 10
Heading = Callable[[float, int], float]
"""Time and frame number → heading relative to the start."""


def number_at(stamp_s: float) -> int:
    """As a camera plays the clip: a still, then to and fro with a rest at both ends."""
    step, span = round((stamp_s - HOLD_S) * RATE_HZ), LAST - FIRST
    if step <= 0:
        return FIRST
    way, along = divmod(step, span + REST)
    return FIRST + min(along, span) if way % 2 == 0 else LAST - min(along, span)


def scored(heading: Heading, *, seconds: float = 20.0, start_rad: float = 0.0) -> float:
    stamps = [step / RATE_HZ for step in range(round(seconds * RATE_HZ))]
    frames = [(stamp, number_at(stamp)) for stamp in stamps]
    headings = [(stamp, start_rad + heading(stamp, number)) for stamp, number in frames]
    headings[0] = (0.0, start_rad)
    return score_following(headings, frames, REFERENCE)


def truth(stamp: float, number: int) -> float:
    return REFERENCE.azimuths[number]


def test_perfect_follower_scores_full() -> None:
    assert scored(truth) == 1.0


def test_start_heading_does_not_matter() -> None:
    assert scored(truth, start_rad=3.0) == 1.0


def test_follower_a_little_behind_scores_full() -> None:
    assert scored(lambda stamp, number: truth(0, number_at(stamp - 0.5))) == 1.0


def test_wrapped_headings_are_understood() -> None:
    def wrapped(stamp: float, number: int) -> float:
        return math.remainder(3.0 + truth(stamp, number), math.tau) - 3.0

    assert scored(wrapped, start_rad=3.0) == 1.0


@pytest.mark.parametrize("seconds", [14, 15.5, 17, 18.5, 20, 22])
def test_no_frozen_heading_passes_in_any_window(seconds: float) -> None:
    best = max(
        scored(lambda stamp, number, at=at: math.radians(at), seconds=seconds)  # type: ignore[misc]  # bound now
        for at in range(-30, 40, 2)
    )
    assert best < WANTED_FRACTION


def test_inverted_follower_fails() -> None:
    assert scored(lambda stamp, number: -truth(stamp, number)) < 0.5


def test_follower_that_is_thirty_degrees_off_fails() -> None:
    assert scored(lambda stamp, number: truth(stamp, number) + math.radians(30)) == 0.0


def test_still_picture_counts_for_nothing() -> None:
    assert scored(truth, seconds=HOLD_S + 9.0) == 0.0


def test_errors_are_signed_and_stamped() -> None:
    frames = [(0.0, FIRST), (1.0, FIRST + 1)]
    headings = [(0.0, 0.5), (2.0, 0.7)]
    found = errors(headings, frames, REFERENCE, start_rad=0.5)
    assert [stamp for stamp, _ in found] == [0.0, 1.0]
    assert found[1][1] == pytest.approx(0.1 - REFERENCE.azimuths[FIRST + 1])


@pytest.mark.parametrize(("headings", "frames"), [([], [(0.0, 1)]), ([(0.0, 0.0)], [])])
def test_empty_logs_cannot_be_scored(
    headings: list[tuple[float, float]], frames: list[tuple[float, int]]
) -> None:
    with pytest.raises(ValueError, match="nothing to score"):
        score_following(headings, frames, REFERENCE)

"""One person's track."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum_visual_tracker.sighting import Sighting
from nondum_visual_tracker.track import DAMPING_S, FREE_S, Track

PERIOD_S = 0.25


def sight(azimuth: float, height: float = 0.3, range_m: float | None = None) -> Sighting:
    return Sighting(azimuth, height, range_m=range_m)


def walked(rate: float, count: int) -> Track:
    """Somebody seen `count` times, whose bearing changes at a rate."""
    track = Track.of(0, sight(0.0), 0.0)
    for step in range(1, count):
        track = track.at(step * PERIOD_S).seen(sight(rate * step * PERIOD_S))
    return track


def test_track_learns_how_somebody_walks() -> None:
    track = walked(0.2, 12)
    assert track.rate == pytest.approx(0.2, abs=0.04)
    assert track.at(track.stamp_s + 0.3).azimuth == pytest.approx(0.2 * 11 * 0.25 + 0.06, abs=0.03)


def test_unseen_person_comes_to_rest() -> None:
    track = walked(0.2, 12)
    later = track.at(track.stamp_s + 20.0)
    assert abs(later.rate) < 1e-3
    reach = track.rate * (FREE_S + DAMPING_S)
    assert later.azimuth - track.azimuth == pytest.approx(reach, abs=0.01)


@given(st.floats(0, 3), st.floats(0, 3))
def test_doubt_grows_while_somebody_is_unseen(first: float, more: float) -> None:
    track = walked(0.1, 4)
    near, far = (track.at(track.stamp_s + dt) for dt in (first, first + more))
    assert far.variance[0] >= near.variance[0] - 1e-12


@given(st.floats(-0.5, 0.5), st.integers(1, 12))
def test_variance_stays_a_variance(rate: float, count: int) -> None:
    a, b, c = walked(rate, count).variance
    assert a > 0
    assert c > 0
    assert a * c - b * b > 0


def test_earlier_time_changes_nothing() -> None:
    track = walked(0.1, 4)
    assert track.at(track.stamp_s - 1) is track


def test_distance_tells_size_and_side_apart() -> None:
    track = walked(0.0, 6)
    here = track.distance(sight(0.0))
    assert track.distance(sight(math.radians(8))) > here + 9
    assert track.distance(sight(0.0, height=0.6)) > here + 9


def test_measured_range_is_kept_until_the_next() -> None:
    track = Track.of(0, sight(0.0, range_m=4.0), 0.0).at(0.1).seen(sight(0.0))
    assert track.range_m == 4.0
    assert track.at(0.2).seen(sight(0.0, range_m=3.0)).range_m == 3.0

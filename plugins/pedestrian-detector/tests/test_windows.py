"""Heaps of windows: one answer for each person, and two for two."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum_pedestrian_detector.windows import Floats, people

edges = st.floats(0, 500)
sizes = st.floats(10, 200)
windows_and_scores = st.lists(
    st.tuples(edges, edges, sizes, sizes, st.floats(0.1, 5)), min_size=1, max_size=12
)
OVERLAP = 0.65


def found(*rows: tuple[float, float, float, float, float]) -> tuple[Floats, Floats]:
    """People among windows, given as left, top, width, height, score."""
    array = np.asarray(rows, dtype=np.float64).reshape(-1, 5)
    return people(array[:, :4], array[:, 4], OVERLAP)


def test_an_empty_image_has_no_people() -> None:
    windows, scores = found()
    assert windows.shape == (0, 4)
    assert scores.shape == (0,)


def test_a_heap_is_one_person_at_its_mean_place() -> None:
    windows, scores = found((0, 0, 48, 96, 1.0), (6, 0, 48, 96, 2.0))
    assert windows.tolist() == [pytest.approx([4, 0, 48, 96])]
    assert scores.tolist() == [2.0]


def test_two_side_by_side_stay_two() -> None:
    windows, _ = found((0, 0, 48, 96, 2.0), (24, 0, 48, 96, 1.0))
    assert sorted(left for left, *_ in windows.tolist()) == [0, 24]


def test_a_window_within_a_surer_one_is_dropped_without_a_vote() -> None:
    windows, _ = found((0, 0, 96, 192, 2.0), (24, 48, 48, 96, 1.0))
    assert windows.tolist() == [[0, 0, 96, 192]]


@given(windows_and_scores)
def test_the_surest_stays_and_order_is_kept(
    rows: list[tuple[float, float, float, float, float]],
) -> None:
    windows, scores = found(*rows)
    assert 1 <= len(windows) == len(scores) <= len(rows)
    assert scores[0] == max(score for *_, score in rows)
    assert (np.diff(scores) <= 0).all()


@given(windows_and_scores)
def test_the_order_of_windows_tells_nothing(
    rows: list[tuple[float, float, float, float, float]],
) -> None:
    distinct = {row[4]: row for row in rows}.values()
    one, other = found(*distinct), found(*reversed(distinct))
    assert np.allclose(one[0], other[0])
    assert np.allclose(one[1], other[1])

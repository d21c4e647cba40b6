"""Heaps of boxes."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum_people_detector.boxes import Found, merged, overlap

edges = st.floats(0, 500, allow_nan=False)
sizes = st.floats(1, 200, allow_nan=False)
boxes = st.builds(Found, edges, edges, sizes, sizes, st.floats(0, 5))


def box(left: float, score: float = 1.0, size: float = 20.0, class_id: str = "person") -> Found:
    return Found(left, 0.0, size, 2 * size, score, class_id)


def test_boxes_of_one_person_become_one() -> None:
    one = merged([box(0), box(2, score=3), box(4)], 0.5)
    assert len(one) == 1
    assert one[0].score == 3
    assert one[0].left == pytest.approx(2)


def test_two_side_by_side_stay_two() -> None:
    assert len(merged([box(0, score=2), box(10)], 0.5)) == 2


def test_box_around_a_better_one_goes() -> None:
    assert len(merged([box(10, score=2), box(0, size=50)], 0.5)) == 1


def test_other_classes_are_left_alone() -> None:
    assert len(merged([box(0), box(0, class_id="goose")], 0.5)) == 2


@given(st.lists(boxes, max_size=12), st.floats(0.1, 0.9))
def test_merging_keeps_the_best_and_their_order(found: list[Found], limit: float) -> None:
    kept = merged(found, limit)
    assert [b.score for b in kept] == sorted((b.score for b in kept), reverse=True)
    assert len(kept) <= len(found)
    assert bool(kept) == bool(found)
    assert max((b.score for b in found), default=0) == max((b.score for b in kept), default=0)


@given(boxes, boxes)
def test_overlap_is_a_symmetric_share(one: Found, other: Found) -> None:
    assert overlap(one, other) == pytest.approx(overlap(other, one))
    assert 0 <= overlap(one, other) <= 1 + 1e-9

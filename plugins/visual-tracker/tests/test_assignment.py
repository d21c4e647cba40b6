"""Assignment of tracks to sightings."""

from __future__ import annotations

import itertools
import math

from hypothesis import given
from hypothesis import strategies as st

from nondum_visual_tracker.assignment import assigned

GATE = 10.0
tables = st.integers(0, 4).flatmap(
    lambda columns: st.lists(
        st.lists(st.floats(0, 20), min_size=columns, max_size=columns), min_size=0, max_size=4
    )
)


def total(cost: list[list[float]], pairs: dict[int, int]) -> float:
    return sum(cost[row][pairs[row]] if row in pairs else GATE for row in range(len(cost)))


def cheapest(cost: list[list[float]]) -> float:
    """By trying everything."""
    columns = range(len(cost[0]) if cost else 0)
    choices = itertools.product(*([*columns, None] for _ in cost))
    best = math.inf
    for choice in choices:
        taken = [column for column in choice if column is not None]
        if len(taken) == len(set(taken)):
            pairs = {row: column for row, column in enumerate(choice) if column is not None}
            best = min(best, total(cost, pairs))
    return best


@given(tables)
def test_assignment_is_the_cheapest(cost: list[list[float]]) -> None:
    pairs = assigned(cost, gate=GATE)
    assert len(set(pairs.values())) == len(pairs)
    assert math.isclose(total(cost, pairs), cheapest(cost), abs_tol=1e-9)


@given(tables)
def test_pair_beyond_the_gate_stays_apart(cost: list[list[float]]) -> None:
    assert all(cost[row][column] <= GATE for row, column in assigned(cost, gate=GATE).items())


def test_two_predicted_off_the_same_way_keep_their_order() -> None:
    """Each is nearest to the other's place, but together they fit only one way."""
    tracks, sightings = [4.5, 10.0], [0.0, 5.5]
    cost = [[(track - seen) ** 2 for seen in sightings] for track in tracks]
    assert assigned(cost, gate=100.0) == {0: 0, 1: 1}

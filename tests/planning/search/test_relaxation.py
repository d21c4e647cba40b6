"""Estimates claim a dead end only where there is one, and name what can be done."""

from __future__ import annotations

from dataclasses import replace

from hypothesis import given
from tests.planning.search.random_tasks import shortest
from tests.planning.search.walks import Walk, encoded_task, walks
from tests.planning.tasks import delivery_task

from nondum.planning.ground.progression import derived_facts
from nondum.planning.search.changes import Changes
from nondum.planning.search.relaxation import Relaxation
from nondum.planning.search.successors import Successors


@given(walks())
def test_dead_end_is_one(walk: Walk) -> None:
    task, encoded, way = walk
    relaxation = Relaxation(encoded, Changes(encoded), [1] * len(encoded.moves))
    for state, mask in way:
        if relaxation.estimate(mask) is None:
            assert shortest(replace(task, init=state - derived_facts(task))) is None


@given(walks())
def test_estimate_knows_what_can_be_done(walk: Walk) -> None:
    _, encoded, way = walk
    relaxation = Relaxation(encoded, Changes(encoded), [1] * len(encoded.moves))
    successors = Successors(encoded)
    for _, mask in way:
        if estimate := relaxation.estimate(mask):
            applicable = sorted(successors.of(mask))
            assert estimate.applicable == applicable
            assert set(estimate.preferred) <= set(applicable)


def test_estimate_of_a_state_does_not_depend_on_the_one_before() -> None:
    encoded = encoded_task(delivery_task())
    relaxation = Relaxation(encoded, Changes(encoded), [1] * len(encoded.moves))
    first = relaxation.estimate(encoded.init)
    for move in encoded.moves:
        if move.precondition & encoded.init == move.precondition:
            relaxation.estimate(encoded.after(encoded.init, move))
    assert relaxation.estimate(encoded.init) == first


def test_distance_counts_the_moves_of_the_relaxed_plan() -> None:
    """Each package is loaded and unloaded, and a truck goes to each place where it is unloaded."""
    encoded = encoded_task(delivery_task())
    estimate = Relaxation(encoded, Changes(encoded), [1] * len(encoded.moves)).estimate(
        encoded.init
    )
    assert estimate is not None
    assert estimate.distance == 6

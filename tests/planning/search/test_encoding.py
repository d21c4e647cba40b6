"""Masks move as the task's states do, and carry nothing that does not matter."""

from __future__ import annotations

from hypothesis import given
from tests.planning.search.walks import Walk, encoded_task, walks
from tests.planning.tasks import Written, follow_task, ground

from nondum.planning.search.successors import Successors
from nondum.sdk.planner import GroundAction, GroundTask


@given(walks())
def test_moves_follow_the_actions(walk: Walk) -> None:
    task, encoded, way = walk
    for state, mask in way:
        assert encoded.is_goal(mask) == (task.goal <= state)
        for move in encoded.moves:
            can_move = move.precondition & mask == move.precondition
            assert can_move == (task.actions[move.action].precondition <= state)


@given(walks())
def test_tree_finds_the_moves_that_can_be_made(walk: Walk) -> None:
    _, encoded, way = walk
    successors = Successors(encoded)
    for _, mask in way:
        expected = [
            index
            for index, move in enumerate(encoded.moves)
            if move.precondition & mask == move.precondition
        ]
        assert sorted(successors.of(mask)) == expected


def test_what_is_true_for_ever_is_no_bit() -> None:
    task = follow_task()
    fluent = {f for f in task.facts if not f.startswith("ready ")}
    assert encoded_task(task).width <= len(fluent) + 1


def test_cheaper_of_two_like_actions_is_kept() -> None:
    fact = frozenset[int]
    dear = GroundAction("dear", fact({0}), fact({1}), fact(), 5)
    cheap = GroundAction("cheap", fact({0}), fact({1}), fact(), 2)
    task = GroundTask(("a", "b"), fact({0}), fact({1}), (dear, cheap))
    assert [move.action for move in encoded_task(task).moves] == [1]


def test_action_that_cannot_be_reached_is_left_out() -> None:
    task = ground(
        [Written("go", "here", "there"), Written("fly", "wings", "there")], "here", "there"
    )
    assert [task.actions[move.action].name for move in encoded_task(task).moves] == ["go"]

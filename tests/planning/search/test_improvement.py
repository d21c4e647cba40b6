"""Plans get cheaper, and stay plans."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
from tests.planning.search.walks import Walk, encoded_task, walks
from tests.planning.tasks import gripper_task, plan_of

from nondum.planning.search.changes import Changes
from nondum.planning.search.encoding import Encoded
from nondum.planning.search.improvement import Improvement, eliminated
from nondum.planning.search.successors import Successors
from nondum.planning.search.tree import Moves


def reaches(encoded: Encoded, plan: Moves) -> bool:
    """Whether every move can be made, and the goal holds after the last."""
    state = encoded.init
    for index in plan:
        move = encoded.moves[index]
        if move.precondition & state != move.precondition:
            return False
        state = encoded.after(state, move)
    return encoded.is_goal(state)


@given(walks(), st.lists(st.integers(0, 5), max_size=8))
def test_what_is_left_of_a_plan_is_one(walk: Walk, choices: list[int]) -> None:
    """Plans are made by walking at random until the goal holds."""
    _, encoded, _ = walk
    successors, state, plan = Successors(encoded), encoded.init, list[int]()
    for choice in choices:
        if applicable := successors.of(state):
            plan.append(applicable[choice % len(applicable)])
            state = encoded.after(state, encoded.moves[plan[-1]])
    if encoded.is_goal(state):
        shorter = eliminated(encoded, tuple(plan))
        assert reaches(encoded, shorter)
        assert len(shorter) <= len(plan)


def test_detour_is_left_out() -> None:
    task = gripper_task(1)
    there = plan_of(task, "move a b", "move b a", "pick ball0 a", "move a b", "drop ball0 b")
    encoded = encoded_task(task)
    index = {move.action: i for i, move in enumerate(encoded.moves)}
    plan = eliminated(encoded, tuple(index[step] for step in there.steps))
    names = [task.actions[encoded.moves[i].action].name for i in plan]
    assert names == ["pick ball0 a", "move a b", "drop ball0 b"]


def test_search_for_cheaper_plans_ends_with_the_best() -> None:
    """One ball is carried at a time: five walks for three balls."""
    encoded = encoded_task(gripper_task(3))
    moves = {m.action: i for i, m in enumerate(encoded.moves)}
    carry = [
        name
        for ball in ("ball0", "ball1", "ball2")
        for name in (
            f"pick {ball} a",
            "move a b",
            "move b a",
            "move a b",
            f"drop {ball} b",
            "move b a",
        )
    ]
    plan = tuple(moves[step] for step in plan_of(gripper_task(3), *carry).steps)
    search = Improvement(encoded, Changes(encoded), plan)
    while not search.advance(1_000):
        assert reaches(encoded, search.plan)
    assert reaches(encoded, search.plan)
    assert len(search.plan) == 11

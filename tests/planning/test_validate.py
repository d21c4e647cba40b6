"""A plan is believed only after each step has been gone through."""

from __future__ import annotations

import pytest

from nondum.planning.search.validate import validate
from nondum.sdk.planner import GroundAction, GroundTask, Plan


def action(name: str, needs: set[int], gives: set[int], takes: set[int]) -> GroundAction:
    return GroundAction(name, frozenset(needs), frozenset(gives), frozenset(takes), cost=2)


TASK = GroundTask(
    facts=("shut", "open", "inside"),
    init=frozenset({0}),
    goal=frozenset({0, 2}),
    actions=(
        action("unlock", {0}, {1}, {0}),
        action("enter", {1}, {2}, set()),
        action("lock", {1}, {0}, {1}),
    ),
)


def test_valid_plan_has_no_problems() -> None:
    assert validate(TASK, Plan((0, 1, 2), 6)) == ()


@pytest.mark.parametrize(
    ("steps", "cost", "code", "message"),
    [
        ((1,), 2, "PLAN_STEP_IMPOSSIBLE", "step 1, enter, needs (open)"),
        ((0, 1), 4, "PLAN_GOAL_MISSED", "(shut) does not hold"),
        ((), 0, "PLAN_GOAL_MISSED", "(inside) does not hold"),
        ((0, 7), 4, "PLAN_STEP_UNKNOWN", "step 2 is action 7 of 3"),
        ((-1,), 2, "PLAN_STEP_UNKNOWN", "step 1 is action -1 of 3"),
        ((0, 1, 2), 5, "PLAN_COST", "not the sum of its steps"),
    ],
)
def test_wrong_plan_is_told(steps: tuple[int, ...], cost: int, code: str, message: str) -> None:
    [problem] = validate(TASK, Plan(steps, cost))
    assert problem.code == code
    assert message in problem.message

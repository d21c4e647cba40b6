"""Landmarks are facts that every plan meets."""

from __future__ import annotations

from hypothesis import given
from tests.planning.search.random_tasks import tasks
from tests.planning.search.walks import encoded_task
from tests.planning.tasks import FOLLOW_PLAN, follow_task

from nondum.planning.search.changes import Changes
from nondum.planning.search.landmarks import Landmarks
from nondum.planning.search.strategy import solve
from nondum.sdk.planner import GroundTask, Plan


def left_along(task: GroundTask, plan: Plan) -> list[int]:
    """How many landmarks are to come at first, and after each step."""
    encoded = encoded_task(task)
    landmarks = Landmarks(encoded, Changes(encoded))
    move_of = {move.action: move for move in encoded.moves}
    state = encoded.init
    met = landmarks.met(0, state)
    left = [landmarks.left(met, state)]
    for step in plan.steps:
        state = encoded.after(state, move_of[step])
        met = landmarks.met(met, state)
        left.append(landmarks.left(met, state))
    return left


@given(tasks())
def test_plan_meets_all_landmarks(task: GroundTask) -> None:
    answer = solve(task, lambda: False)
    if isinstance(answer, Plan):
        assert left_along(task, answer)[-1] == 0


def test_chain_is_counted_down() -> None:
    """Image, detections, twist: each is needed for the next, whichever camera it begins with."""
    answer = solve(follow_task(), lambda: False)
    assert isinstance(answer, Plan)
    left = left_along(follow_task(), answer)
    assert left == sorted(left, reverse=True)
    assert left[0] >= len(FOLLOW_PLAN) - 1

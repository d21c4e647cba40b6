"""Plans after a recomposition: kept while what is left of them still works."""

from __future__ import annotations

from tests.planning.tasks import FOLLOW_LASTING, FOLLOW_PLAN, follow_task, plan_of

from nondum.planning.execute.replay import replayed
from nondum.planning.execute.step import words
from nondum.sdk.planner import GroundTask


def without(task: GroundTask, name: str) -> GroundTask:
    actions = tuple(action for action in task.actions if action.name != name)
    return GroundTask(task.facts, task.init, task.goal, actions)


def test_plan_is_kept_by_name_in_a_task_of_other_numbers() -> None:
    task = follow_task()
    other = GroundTask(task.facts, task.init, task.goal, tuple(reversed(task.actions)))
    believed = words(task, task.init)
    assert replayed(other, FOLLOW_PLAN, believed, FOLLOW_LASTING) == plan_of(other, *FOLLOW_PLAN)


def test_lost_step_that_is_still_needed_ends_the_plan() -> None:
    task = without(follow_task(), FOLLOW_PLAN[1])
    assert replayed(task, FOLLOW_PLAN, words(task, task.init), FOLLOW_LASTING) is None


def test_lost_step_that_is_done_does_not_matter() -> None:
    task = without(follow_task(), FOLLOW_PLAN[0])
    believed = words(task, task.init) | {"flowing cam-img"}
    kept = replayed(task, FOLLOW_PLAN, believed, FOLLOW_LASTING)
    assert kept == plan_of(task, *FOLLOW_PLAN[1:])


def test_plan_for_another_goal_is_not_kept() -> None:
    task = follow_task("found r")
    assert replayed(task, FOLLOW_PLAN, words(task, task.init), FOLLOW_LASTING) is None

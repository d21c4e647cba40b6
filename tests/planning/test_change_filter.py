"""What a task looks at: news about something else costs it nothing, and it misses nothing."""

from __future__ import annotations

from random import Random

import pytest
from tests.planning.simulation import Robot, Troubles, replanned, task_tree
from tests.planning.tasks import FOLLOW_LASTING, FOLLOW_PLAN, follow_task, plan_of, survey_task

from nondum.planning.execute.change_filter import ChangeFilter
from nondum.planning.execute.plan_executive import Phase
from nondum.planning.execute.task_tree import TaskTree


def holding() -> tuple[Robot, TaskTree]:
    """A robot that follows, its whole chain established."""
    robot = Robot(follow_task(), FOLLOW_LASTING)
    tree = task_tree(robot, plan_of(robot.task, *FOLLOW_PLAN), kind="maintain")
    for _ in range(20):
        tree.tick_once()
        robot.moment()
    assert tree.control.phase is Phase.HOLDING
    return robot, tree


def test_news_about_something_else_asks_for_no_decision() -> None:
    robot, tree = holding()
    tree.tick_once()
    before = tree.control.decisions
    robot.world.know("raining", "roof", robot.now_s)
    tree.tick_once()
    assert robot.world.holds("raining")
    assert tree.control.decisions == before


def test_lost_footing_asks_for_one() -> None:
    robot, tree = holding()
    robot.world.know("raining", "roof", robot.now_s)
    tree.tick_once()
    before = tree.control.decisions
    robot.world.forget("ready cam", "truth", robot.now_s)
    tree.tick_once()
    assert tree.control.decisions == before + 1
    assert all(run.is_halting for run in tree.control.runs.values())


@pytest.mark.parametrize("seed", range(25))
def test_decisions_that_are_spared_would_change_nothing(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    thrifty = life(seed)
    monkeypatch.setattr(ChangeFilter, "is_as_before", lambda *_: False)
    assert life(seed) == thrifty


def life(seed: int) -> list[tuple[Phase, list[str], list[str]]]:
    """What a tree does in a troubled world: its phase, what runs and what waits, tick by tick."""
    troubles = Troubles(silent=0.1, fails=0.05, dies=0.03, changes=0.05, losses=0.03)
    robot = Robot(survey_task(), FOLLOW_LASTING, Random(seed), troubles)
    tree = replanned(robot, None, "maintain")
    assert tree is not None
    seen = []
    for moment in range(150):
        tree.tick_once()
        whys = [leaf.why() for leaf in tree.steps]
        seen.append((tree.control.phase, list(tree.control.runs), whys))
        robot.world.know(f"noise-{moment}", "roof", robot.now_s)
        robot.moment()
    return seen

"""Fifty plugins merge, ground and plan with little work, and one more costs little."""

from __future__ import annotations

from dataclasses import replace

from tests.kit.work import steps_of
from tests.planning.strangers import ROVER, STRANGERS, at_rest, component, planner

from nondum.planning.ground.ground import ground
from nondum.planning.merge.contribution import Contribution
from nondum.planning.merge.goal import parse_goal
from nondum.planning.merge.merge import merge
from nondum.sdk.planner import GroundTask, Plan


def many(count: int) -> list[Contribution]:
    """The ten strangers over and over, each time as plugins of another name."""
    return [
        component(replace(STRANGERS[i % 10], name=f"{STRANGERS[i % 10].name}-{i // 10}"))
        for i in range(count)
    ]


def grounded(present: list[Contribution]) -> GroundTask:
    merged = merge(present, ROVER)
    goal = parse_goal("(following self person)", merged)
    return ground(merged, at_rest(present, merged), goal.expr)


def test_fifty_plugins_are_planned_with() -> None:
    task = grounded(many(50))
    answer = planner().plan(task, 20.0)
    assert isinstance(answer, Plan)
    assert len(answer.steps) == 4


def test_fifty_plugins_are_grounded_with_little_work() -> None:
    """0.1 s is the promise, of which some 250,000 steps take half."""
    present = many(50)
    grounded(present)  # the first parses, too
    assert steps_of(lambda: grounded(present)) < 500_000


def test_work_grows_no_faster_than_pairs_of_plugins() -> None:
    few, twice = many(50), many(100)
    grounded(twice)
    assert steps_of(lambda: grounded(twice)) < 4 * steps_of(lambda: grounded(few))


def test_one_more_plugin_is_merged_with_little_work() -> None:
    """What each component says is checked once; the fifty-first costs its own check and little
    more: to check all would be 1,900,000 steps."""
    present = many(51)
    merge(present[:50], ROVER)
    assert steps_of(lambda: merge(present, ROVER)) < 100_000

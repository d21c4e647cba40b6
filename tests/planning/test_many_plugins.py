"""Fifty plugins merge, ground and plan in time, and one more costs little."""

from __future__ import annotations

import time
from dataclasses import replace

import pytest
from tests.planning.strangers import ROVER, STRANGERS, at_rest, component, planner

from nondum.planning.contribution import Contribution
from nondum.planning.goal import parse_goal
from nondum.planning.ground import ground
from nondum.planning.merge import merge
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


def seconds(present: list[Contribution]) -> float:
    """Processor time of merging and grounding, the best of three: the first parses, too."""
    taken = []
    for _ in range(3):
        began = time.process_time()
        grounded(present)
        taken.append(time.process_time() - began)
    return min(taken)


def test_fifty_plugins_are_planned_with() -> None:
    task = grounded(many(50))
    answer = planner().plan(task, 20.0)
    assert isinstance(answer, Plan)
    assert len(answer.steps) == 4


@pytest.mark.slow
def test_fifty_plugins_are_merged_and_grounded_in_time() -> None:
    """0.1 s is the promise; three times as much allows for a busy machine."""
    assert seconds(many(50)) < 0.3


@pytest.mark.slow
def test_one_more_plugin_is_merged_in_a_moment() -> None:
    """What each component says is checked once; the fifty-first costs its own check and little
    more."""
    present = many(51)
    merge(present[:50], ROVER)
    began = time.process_time()
    merge(present, ROVER)
    assert time.process_time() - began < 0.1

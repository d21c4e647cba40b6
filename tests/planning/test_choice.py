"""Who else could play a step's part."""

from __future__ import annotations

from dataclasses import replace

from tests.planning.tasks import FOLLOW_LASTING, FOLLOW_PLAN, Written, follow_task, ground, plan_of

from nondum.planning.execute.choice import Alternatives
from nondum.planning.execute.regression import Regression
from nondum.planning.execute.step import steps_of, words
from nondum.sdk.planner import GroundTask


def kind(name: str) -> str:
    """Streams of one kind end alike; everything else is a separate kind."""
    return name.rpartition("-")[2]


def alternatives(task: GroundTask, *names: str) -> list[list[str]]:
    steps = steps_of(task, plan_of(task, *names), FOLLOW_LASTING)
    regression = Regression(steps, words(task, task.goal))
    found = Alternatives(task, kind).of_plan(regression)
    return [[action.name for action in others] for others in found]


def test_another_camera_could_have_been_taken() -> None:
    assert alternatives(follow_task(), *FOLLOW_PLAN) == [
        ["cam.stream thermal thermal-img r"],
        [],
        [],
        [],
    ]


def test_cheapest_comes_first_and_once_for_each_unit() -> None:
    task = ground(
        [
            Written("p.lift one", "a", "up"),
            Written("p.lift two", "a", "up"),
            Written("p.lift three x", "a", "up"),
            Written("p.lift three y", "a", "up"),
            Written("p.sing one", "a", "song"),
        ],
        "a",
        "up",
    )
    costs = {"p.lift two": 3, "p.lift three x": 2, "p.lift three y": 1}
    actions = tuple(replace(a, cost=costs.get(a.name, 1)) for a in task.actions)
    task = GroundTask(task.facts, task.init, task.goal, actions)
    assert alternatives(task, "p.lift one") == [["p.lift three y", "p.lift two"]]


def test_what_the_plan_does_anyway_is_no_alternative() -> None:
    task = ground([Written("p.one u", "a", "x"), Written("p.two v", "a", "x, y")], "a", "x, y")
    assert alternatives(task, "p.one u", "p.two v") == [[], []]

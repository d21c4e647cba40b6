"""pyperplan's search answers in nondum's words, in time, and claims nothing without a proof."""

from __future__ import annotations

import itertools
import os
import subprocess
import sys
from importlib.metadata import entry_points
from pathlib import Path

import pytest

from nondum.sdk.planner import (
    AlreadyTrue,
    GaveUp,
    GroundAction,
    GroundTask,
    Plan,
    Planner,
    Unsolvable,
)
from nondum_planner_pyperplan import PyperplanPlanner


def action(
    name: str, needs: set[int], gives: set[int], takes: set[int], cost: int = 1
) -> GroundAction:
    return GroundAction(name, frozenset(needs), frozenset(gives), frozenset(takes), cost)


def task(
    goal: set[int], *actions: GroundAction, init: frozenset[int] = frozenset({0})
) -> GroundTask:
    names = tuple(f"f{index}" for index in range(6))
    return GroundTask(names, init, frozenset(goal), actions)


def counter(bits: int) -> GroundTask:
    """Counting to 2^bits, one action a step: fact 2i says that bit i is off, 2i+1 that it is on."""
    actions = []
    for bit in range(bits):
        ones = {2 * lower + 1 for lower in range(bit)}
        zeros = {2 * lower for lower in range(bit)}
        actions.append(
            action(f"carry {bit}", {2 * bit} | ones, {2 * bit + 1} | zeros, {2 * bit} | ones)
        )
    facts = tuple(f"bit{index // 2} {index % 2}" for index in range(2 * bits))
    off, on = frozenset(range(0, 2 * bits, 2)), frozenset(range(1, 2 * bits, 2))
    return GroundTask(facts, off, on, tuple(actions))


@pytest.fixture
def planner() -> PyperplanPlanner:
    """A planner for which no time passes."""
    return PyperplanPlanner(now_s=lambda: 0.0)


def test_planner_is_found_by_its_entry_point() -> None:
    [found] = entry_points(group="nondum.planners", name="pyperplan")
    planner = found.load()()
    assert isinstance(planner, Planner)
    assert planner.speaks == "ground"


def test_plan_names_actions_by_index(planner: PyperplanPlanner) -> None:
    steps = task({2}, action("b", {1}, {2}, set(), 5), action("a", {0}, {1}, set(), 2))
    assert planner.plan(steps, 5) == Plan((1, 0), cost=7)


def test_goal_that_holds_needs_no_plan(planner: PyperplanPlanner) -> None:
    assert planner.plan(task({0}), 5) == AlreadyTrue()


def test_action_without_condition_is_used(planner: PyperplanPlanner) -> None:
    assert planner.plan(task({1}, action("a", set(), {1}, set()), init=frozenset()), 5) == Plan(
        (0,), 1
    )


def test_unreachable_goal_is_proved_without_search(planner: PyperplanPlanner) -> None:
    assert planner.plan(task({3}, action("a", {0}, {1}, set())), 5) == Unsolvable("relaxed")


def test_goals_that_exclude_each_other_are_proved_by_exhaustion(planner: PyperplanPlanner) -> None:
    choice = task({1, 2}, action("a", {0}, {1}, {0}), action("b", {0}, {2}, {0}))
    assert planner.plan(choice, 5) == Unsolvable("exhausted")


def test_needed_detour_is_taken(planner: PyperplanPlanner) -> None:
    """Helpful-action pruning would cut off the step that undoes what is helpful."""
    detour = task(
        {3, 4},
        action("take", {0}, {1}, {0}),
        action("use", {1}, {3}, set()),
        action("give back", {1}, {0}, {1}),
        action("other", {0}, {4}, {0}),
    )
    answer = planner.plan(detour, 5)
    assert isinstance(answer, Plan)
    assert [detour.actions[step].name for step in answer.steps] == [
        "take",
        "use",
        "give back",
        "other",
    ]


def test_search_ends_at_the_first_state_after_the_deadline() -> None:
    seconds = itertools.count()
    planner = PyperplanPlanner(now_s=lambda: next(seconds))
    assert planner.plan(counter(40), 3) == GaveUp("no plan within 3 s")
    assert next(seconds) == 5, "the start, three states in time and one too late"


def test_answer_does_not_depend_on_the_hash_seed() -> None:
    program = (
        "from test_planner import counter, PyperplanPlanner;"
        "print(PyperplanPlanner().plan(counter(6), 30))"
    )
    answers = {
        subprocess.run(
            [sys.executable, "-c", program],
            env={**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": str(Path(__file__).parent)},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for seed in ("1", "2", "3")
    }
    assert len(answers) == 1
    assert "steps=" in answers.pop()

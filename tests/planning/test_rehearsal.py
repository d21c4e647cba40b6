"""A plan tried out on schemas: each step is bound, asked for and carried out as it is written."""

from __future__ import annotations

import pytest
from tests.kit.golden import Golden
from tests.planning.differential.semantics import Problem
from tests.planning.differential.texts import TEXTS, Text

from nondum.planning.ground.lifted import Meaning
from nondum.planning.search import solve
from nondum.sdk.planner import Plan
from nondum_pddl_workbench.rehearsal import rehearsed

BY_NAME = {text.name: text for text in TEXTS}


def steps_of(text: Text) -> list[str]:
    task = text.task()
    answer = solve(task, lambda: False)
    assert isinstance(answer, Plan)
    return [task.actions[step].name for step in answer.steps]


def rehearse(name: str, *steps: str) -> tuple[int, str]:
    """How many steps are taken, and what is wrong."""
    loaded = BY_NAME[name].load()
    found = rehearsed(loaded.merged, loaded.facts, loaded.goal, steps)
    return found.taken, "; ".join(f"{one.code} {one.message}" for one in found.problems)


@pytest.mark.parametrize("text", [t for t in TEXTS if t.shortest], ids=str)
def test_no_step_of_a_shortest_plan_can_be_left_out(text: Text) -> None:
    steps = steps_of(text)
    assert rehearse(text.name, *steps) == (len(steps), "")
    for left_out in range(len(steps)):
        assert rehearse(text.name, *steps[:left_out], *steps[left_out + 1 :])[1]


def test_a_step_that_does_not_help_is_still_a_step() -> None:
    assert rehearse("quantifiers", "switch n", *steps_of(BY_NAME["quantifiers"]))[1] == ""
    assert "(not (tried two))" in rehearse("disjunction", "try two", "try two")[1]


@pytest.mark.parametrize(
    ("steps", "told"),
    [
        (["fly t x"], "PLAN_STEP_UNKNOWN step 1, (fly t x): there is no action 'fly'"),
        (["drive t x"], "PLAN_STEP_UNKNOWN step 1, (drive t x): 'drive' has 3 parameters"),
        (["drive t x q"], "PLAN_STEP_UNKNOWN step 1, (drive t x q): there is no object 'q'"),
        (["drive f x y"], "PLAN_STEP_UNKNOWN step 1, (drive f x y): f is plane, ?t is truck"),
        (["drive t y z"], "PLAN_STEP_IMPOSSIBLE step 1, (drive t y z), needs (at t y)"),
        (["drive t x y"], "PLAN_GOAL_MISSED at the end the goal is missed: (in p t)"),
    ],
    ids=["action", "arity", "object", "type", "precondition", "goal"],
)
def test_what_is_wrong_is_told_of_the_step(steps: list[str], told: str) -> None:
    assert rehearse("typing", *steps)[1] == told


def test_a_step_without_a_cost_cannot_be_taken(golden: Golden) -> None:
    taken, told = rehearse("costs", "walk a c")
    assert taken == 0
    golden.check("a step has no cost", told)


@pytest.mark.parametrize("text", TEXTS, ids=str)
def test_states_settle_as_pddl_says(text: Text) -> None:
    loaded, problem = text.load(), Problem.of(text)
    types = {name: thing.types for name, thing in loaded.merged.objects.items()}
    meaning = Meaning(loaded.merged, types)
    found = meaning.situation(meaning.start(loaded.facts))
    atoms = {(predicate, *row) for predicate, rows in found.rows.items() for row in rows}
    assert atoms == problem.settled(problem.start)

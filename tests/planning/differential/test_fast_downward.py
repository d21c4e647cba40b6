"""Fast Downward and nondum find the same actions, the same problems solvable, and each other's
plans right."""

from __future__ import annotations

import os
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import given
from tests.kit.examples import a_share
from tests.planning.differential.generated import texts
from tests.planning.differential.sas import Sas, translated
from tests.planning.differential.semantics import Problem
from tests.planning.differential.states import all_that_can_be_done, small
from tests.planning.differential.texts import TEXTS, Text

from nondum.planning.ground.pddl_text import pddl_text
from nondum.planning.search import solve
from nondum.sdk.planner import AlreadyTrue, GaveUp, PddlTask, Plan, PlanText, Unsolvable
from nondum_pddl_workbench.rehearsal import rehearsed
from nondum_pddl_workbench.standalone import Standalone
from nondum_planner_fast_downward import FastDownwardPlanner
from nondum_planner_fast_downward.engine import find_engine

ENGINE = find_engine()
PATIENCE_S = 60.0
needs_engine = pytest.mark.skipif(
    ENGINE is None and "CI" not in os.environ, reason="no wheel with Fast Downward"
)


def written(loaded: Standalone) -> PddlTask:
    return pddl_text(loaded.merged, loaded.facts, loaded.goal)


def sas_of(task: PddlTask) -> Sas:
    assert ENGINE is not None
    with TemporaryDirectory() as folder:
        return translated(ENGINE, task, Path(folder))


def check_plans(text: Text) -> None:
    """Both plan, or neither does; and each takes the other's plan."""
    loaded = text.load()
    answer = FastDownwardPlanner().plan(written(loaded), PATIENCE_S)
    task = text.task()
    mine = solve(task, lambda: False)
    match answer:
        case PlanText(steps):
            found = rehearsed(loaded.merged, loaded.facts, loaded.goal, steps)
            assert not found.problems
            assert isinstance(mine, Plan)
        case AlreadyTrue():
            assert isinstance(mine, AlreadyTrue)
        case Unsolvable():
            assert isinstance(mine, Unsolvable)
        case GaveUp(why):
            assert "axioms" in why or "not complete" in why, why
            assert isinstance(mine, Unsolvable)
    sas = sas_of(written(loaded))
    if isinstance(mine, Plan) and not sas.has_axioms:
        assert sas.reaches_goal([task.actions[step].name for step in mine.steps])


@needs_engine
@pytest.mark.parametrize("text", [text for text in TEXTS if text.shortest is not None], ids=str)
def test_the_same_actions_can_be_reached(text: Text) -> None:
    loaded = text.load()
    mine = {action.name for action in all_that_can_be_done(loaded).actions}
    assert {operator.name for operator in sas_of(written(loaded)).operators} == mine


@needs_engine
@pytest.mark.parametrize("text", TEXTS, ids=str)
def test_each_takes_the_plan_of_the_other(text: Text) -> None:
    check_plans(text)


@needs_engine
@pytest.mark.slow
@given(text=texts())
@a_share(3)
def test_no_problem_is_solvable_for_one_of_them_only(text: Text) -> None:
    small(Problem.of(text))
    check_plans(text)


@needs_engine
@pytest.mark.slow
@given(text=texts())
@a_share(3)
def test_whatever_can_be_done_is_found_by_both(text: Text) -> None:
    graph = small(Problem.of(text))
    loaded = text.load()
    done = {name for after in graph.values() for name, _ in after}
    assert done <= {action.name for action in all_that_can_be_done(loaded).actions}
    # Where the goal is beyond doubt, or out of reach, it writes a task with nothing in it.
    operators = {operator.name for operator in sas_of(written(loaded)).operators}
    assert not operators or done <= operators

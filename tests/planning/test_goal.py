"""Goals are read, checked against the words known now, and checked again later."""

from __future__ import annotations

import pytest
from tests.planning.strangers import COMPTON_CAMERA, PAN_TILT_UNIT, ROVER, components

from nondum.planning.merge.goal import goal_problems, goal_text, parse_goal
from nondum.planning.merge.merge import merge
from nondum.sdk.errors import GoalRefused

BOTH = merge(components([COMPTON_CAMERA, PAN_TILT_UNIT]), ROVER)


def test_self_is_the_planning_host() -> None:
    goal = parse_goal("(pointing self radiation-source)", BOTH, kind="maintain")
    assert str(goal) == "maintain (pointing rover radiation-source)"
    assert goal.text == "(pointing self radiation-source)"


def test_goal_may_be_a_conjunction() -> None:
    text = "(and (pointing rover radiation-source) (not (flowing x)) (not (= rover rover)))"
    text = text.replace("(not (flowing x)) ", "")
    assert goal_text(parse_goal(text, BOTH).expr) == text


WRONG = {
    "syntax": ("(pointing self", "PDDL_SYNTAX", "expected"),
    "predicate": ("(point self radiation-source)", "PDDL_UNKNOWN", "did you mean 'pointing'?"),
    "object": (
        "(pointing self radiation-sauce)",
        "PDDL_UNKNOWN",
        "did you mean 'radiation-source'?",
    ),
    "type": ("(pointing radiation-source self)", "PDDL_TYPE", "expected host"),
    "arity": ("(pointing self)", "PDDL_ARITY", "(pointing self) has 1 arguments"),
    "disjunction": ("(or (pointing self radiation-source) (ready x))", "PDDL_UNKNOWN", "'x'"),
    "number": ("(> (dose self) 3)", "PDDL_UNSUPPORTED", "the numeric condition (> (dose self) 3)"),
    "variable": ("(pointing self ?x)", "PDDL_UNKNOWN", "?x is not a parameter"),
}


@pytest.mark.parametrize(("text", "code", "message"), WRONG.values(), ids=WRONG)
def test_wrong_goal_is_refused_with_a_caret(text: str, code: str, message: str) -> None:
    with pytest.raises(GoalRefused) as refused:
        parse_goal(text, BOTH)
    problem = refused.value.problems[0]
    assert problem.code == code
    assert problem.where.startswith("goal:1:")
    assert message in str(problem)
    assert text in problem.message


def test_goal_about_an_object_that_has_gone_is_told() -> None:
    goal = parse_goal("(pointing self radiation-source)", BOTH)
    assert not goal_problems(goal, BOTH)
    left = merge(components([PAN_TILT_UNIT]), ROVER)
    assert [problem.code for problem in goal_problems(goal, left)] == ["PDDL_UNKNOWN"]

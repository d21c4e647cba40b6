"""PDDL that is no fragment: domain and problem as their authors wrote them."""

from __future__ import annotations

import pytest

from nondum.planning.ground.ground import ground
from nondum.planning.search import solve
from nondum.sdk.errors import FragmentRefused, Problem
from nondum.sdk.planner import GroundTask, Plan
from nondum_pddl_workbench.standalone import Standalone, load

DOMAIN = """(define (domain ferry)
  (:types port - place ship)
  (:predicates (at ?s - ship ?p - port) (not-full ?s - ship) (on ?s - ship))
  (:functions (way ?a ?b - port) (total-cost))
  (:action sail
    :parameters (?s - ship ?a ?b - port)
    :precondition (and (at ?s ?a) (not-full ?s) (not (= ?a ?b)))
    :effect (and (not (at ?s ?a)) (at ?s ?b) (increase (total-cost) (way ?a ?b))))
  (:action load
    :parameters (?s - ship)
    :precondition (not-full ?s)
    :effect (and (not (not-full ?s)) (on ?s))))
"""
PROBLEM = """(define (problem one) (:domain ferry)
  (:objects self - ship a b c - port)
  (:init (at self a) (not-full self) (= (total-cost) 0) (= (way a b) 4) (= (way b c) 1))
  (:goal (and (at self c) (on self)))
  {metric})
"""


def loaded(problem: str, domain: str = DOMAIN) -> Standalone:
    return load(domain, "domain.pddl", problem, "problem.pddl")


def task(metric: str = "") -> GroundTask:
    found = loaded(PROBLEM.format(metric=metric))
    return ground(found.merged, found.facts, found.goal)


def refused(problem: str, domain: str = DOMAIN) -> Problem:
    with pytest.raises(FragmentRefused) as error:
        loaded(problem, domain)
    return error.value.problems[0]


def plan(of: GroundTask) -> tuple[list[str], int]:
    answer = solve(of, lambda: False)
    assert isinstance(answer, Plan)
    return [of.actions[step].name for step in answer.steps], answer.cost


def test_words_of_the_core_mean_what_their_authors_mean() -> None:
    """`on`, `self` and `not-…` are nothing special in a standalone domain."""
    steps, _ = plan(task())
    assert steps == ["sail self a c", "load self"]


def test_without_a_metric_every_action_costs_one() -> None:
    assert plan(task())[1] == 2


def test_with_a_metric_an_action_that_names_no_cost_costs_nothing() -> None:
    assert plan(task("(:metric minimize (total-cost))"))[1] == 5


def test_action_with_a_function_without_a_value_cannot_be_taken() -> None:
    names = {action.name for action in task("(:metric minimize (total-cost))").actions}
    assert "sail self a b" in names
    assert "sail self a c" not in names


WRONG = {
    "unknown object": ("(at self d)", "PDDL_UNKNOWN", "'d' is not declared"),
    "wrong type": ("(at a a)", "PDDL_TYPE", "expected ship, a is port"),
    "wrong arity": ("(at self)", "PDDL_ARITY", "(at self) has 1 arguments"),
    "unknown predicate": ("(att self a)", "PDDL_UNKNOWN", "predicate 'att' is not declared"),
    "half a number": ("(= (way a c) 1.5)", "PDDL_INIT", "only whole numbers"),
    "negation": ("(not (at self b))", "PDDL_INIT", "is not a fact"),
    "too big a number": ("(= (way a c) 9007199254740993)", "PDDL_INIT", "numbers below 2^53"),
    "two numbers": ("(= (way a c) 1) (= (way a c) 2)", "PDDL_TWICE", "(way a c) is 1 at problem"),
}


@pytest.mark.parametrize(("fact", "code", "message"), WRONG.values(), ids=WRONG)
def test_wrong_fact_is_refused_where_it_stands(fact: str, code: str, message: str) -> None:
    found = refused(PROBLEM.format(metric="").replace("(at self a)", f"(at self a) {fact}"))
    assert found.code == code
    assert message in found.message
    assert found.where.startswith("problem.pddl:3:")


def test_all_that_is_wrong_is_told_at_once() -> None:
    with pytest.raises(FragmentRefused) as error:
        loaded(PROBLEM.format(metric="").replace("a b c", "a b").replace("self c", "self z"))
    assert [problem.where for problem in error.value.problems] == [
        "problem.pddl:3:83",
        "problem.pddl:4:24",
    ]


GOALS = {
    "when": ("(when (on self) (on self))", "PDDL_MISPLACED", "a condition says 'imply'"),
    "comparison": ("(> (way a b) 2)", "PDDL_UNSUPPORTED", "the numeric condition (> (way a b) 2"),
    "increase": (
        "(increase (total-cost) 1)",
        "PDDL_UNSUPPORTED",
        "the numeric condition (increase",
    ),
}


@pytest.mark.parametrize(("goal", "code", "message"), GOALS.values(), ids=GOALS)
def test_goal_that_is_no_condition_is_refused_where_it_stands(
    goal: str, code: str, message: str
) -> None:
    found = refused(PROBLEM.format(metric="").replace("(on self)))", f"{goal}))"))
    assert found.code == code
    assert message in found.message
    assert found.where == "problem.pddl:4:28"


def test_unknown_type_is_told_where_it_stands_and_nowhere_else() -> None:
    with pytest.raises(FragmentRefused) as error:
        loaded(PROBLEM.format(metric=""), DOMAIN.replace("(at ?s - ship", "(at ?s - shop"))
    assert [problem.where for problem in error.value.problems] == ["domain.pddl:3:20"]
    assert "'ship'" in error.value.problems[0].fix


def test_nothing_is_above_object() -> None:
    found = refused(PROBLEM.format(metric=""), DOMAIN.replace("port - place", "object - place"))
    assert (found.code, found.where) == ("PDDL_TYPE_CYCLE", "domain.pddl:2:11")


def test_circle_of_rules_names_those_that_deny_each_other() -> None:
    """Neither a rule that needs itself to hold, nor one that hangs on the circle, is in it."""
    rules = """(:predicates (up) (down) (out) (far ?a ?b - port))
      (:derived (far ?a ?b - port) (exists (?c - port) (far ?a ?c)))
      (:derived (out) (up)) (:derived (up) (not (down))) (:derived (down) (up))"""
    found = refused("", f"(define (domain d) (:types port) {rules})")
    assert found.message.startswith("these hold only if they do not: down, up\n")
    assert found.where == "domain.pddl:3:69"


def test_problem_of_another_domain_is_told() -> None:
    [warning] = loaded(PROBLEM.format(metric="").replace(":domain ferry", ":domain boat")).warnings
    assert warning.code == "PDDL_DOMAIN"
    assert "'boat'" in warning.message
    assert not loaded(PROBLEM.format(metric="")).warnings


def test_problem_without_a_goal_is_refused() -> None:
    assert refused("(define (problem one) (:domain ferry))").code == "PDDL_GOAL"


def test_two_domains_are_no_task() -> None:
    assert refused(DOMAIN).code == "PDDL_KIND"

"""What pyperplan 2.1 reads wrongly, refuses, or never comes back from: nondum does none of it."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest
from tests.planning.differential.texts import Text, text

from nondum.host.mind.native_planner import NativePlanner
from nondum.planning.ground.ground import ground
from nondum.planning.search import solve
from nondum.sdk.errors import FragmentRefused
from nondum.sdk.planner import GaveUp, GroundTask, Plan, Unsolvable
from nondum_pddl_workbench.standalone import load, load_domain
from nondum_planner_pyperplan import PyperplanPlanner

ROADS = """(:predicates (at ?x) (road ?x ?y))
    (:action go :parameters (?x ?y) :precondition (and (at ?x) (road ?x ?y))
      :effect (and (at ?y) (not (at ?x))))"""


def plan_of(text: Text) -> list[str]:
    """A plan, found by nondum's own search."""
    task = text.task()
    answer = solve(task, lambda: False)
    assert isinstance(answer, Plan), answer
    return [task.actions[step].name for step in answer.steps]


def plan(domain: str, problem: str) -> list[str]:
    return plan_of(text("t", domain, problem, None))


def refusal(domain: str, problem: str) -> tuple[str, str]:
    """Code and words of what is wrong, which must be told with its place."""
    found = text("t", domain, problem, None)
    with pytest.raises(FragmentRefused) as refused:
        found.load()
    (problem_found,) = refused.value.problems
    assert ".pddl:" in problem_found.where
    return problem_found.code, problem_found.message.splitlines()[0]


@pytest.mark.parametrize("name", ["a.b", "a@b"])
def test_a_name_that_is_none_is_refused_instead_of_losing_the_plan(name: str) -> None:
    code, words = refusal(
        ROADS, f"(:objects {name} c) (:init (at {name}) (road {name} c)) (:goal (at c))"
    )
    assert code == "PDDL_SYNTAX"
    assert f"found '{name[1:]}'" in words


def test_types_in_a_circle_are_refused_at_once() -> None:
    with pytest.raises(FragmentRefused) as refused:
        load_domain("(define (domain t) (:types a - b b - a))", "t.pddl")
    assert refused.value.code == "PDDL_TYPE_CYCLE"
    assert "a - b, b - a" in str(refused.value)


def counting(bits: int) -> GroundTask:
    """A task that takes 2^bits steps, and some time."""
    rules = "".join(
        f"(:action carry{n} :parameters () :precondition (and (not (b{n}))"
        + "".join(f"(b{low})" for low in range(n))
        + f") :effect (and (b{n})"
        + "".join(f"(not (b{low}))" for low in range(n))
        + "))"
        for n in range(bits)
    )
    words = " ".join(f"(b{n})" for n in range(bits))
    return text(
        "count", f"(:predicates {words}) {rules}", f"(:init) (:goal (and {words}))", 0
    ).task()


@pytest.mark.parametrize(
    "planner", [NativePlanner(), PyperplanPlanner()], ids=["native", "pyperplan"]
)
def test_no_answer_is_never_called_unsolvable(planner: NativePlanner | PyperplanPlanner) -> None:
    assert isinstance(planner.plan(counting(18), 0.05), GaveUp)


@pytest.mark.parametrize(
    "planner", [NativePlanner(), PyperplanPlanner()], ids=["native", "pyperplan"]
)
def test_pruning_loses_no_plan(planner: NativePlanner | PyperplanPlanner) -> None:
    answer = planner.plan(counting(5), 30.0)
    assert isinstance(answer, Plan)
    assert len(answer.steps) == 31


def test_either_among_types_and_on_objects() -> None:
    domain = """(:types a b - object c - (either a b))
        (:predicates (p ?x - a) (q ?x - b))
        (:action do :parameters (?x - a) :precondition (and) :effect (p ?x))
        (:action make :parameters (?x - b) :precondition (and) :effect (q ?x))"""
    goal = "(:init) (:goal (and (p x) (q x)))"
    assert plan(domain, f"(:objects x - c) {goal}") == ["do x", "make x"]
    assert plan(domain, f"(:objects x - (either a b)) {goal}") == ["do x", "make x"]


@pytest.mark.parametrize(
    "precondition", ["", ":precondition ()", ":precondition (and)"], ids=["none", "()", "and"]
)
def test_an_action_that_needs_nothing(precondition: str) -> None:
    domain = f"(:predicates (p)) (:action do :parameters () {precondition} :effect (p))"
    assert plan(domain, "(:init) (:goal (p))") == ["do"]


def test_a_domain_without_predicates() -> None:
    loaded = load(
        "(define (domain t) (:action do :parameters () :effect (and)))",
        "d.pddl",
        "(define (problem p) (:domain t) (:init) (:goal (and)))",
        "p.pddl",
    )
    task = ground(loaded.merged, loaded.facts, loaded.goal)
    assert not task.goal


@pytest.mark.parametrize(
    "precondition",
    [
        "(and (at ?x) (and (road ?x ?y) (and)))",
        "(and (at ?x) (road ?x ?y) (not (at ?y)))",
        "(and (at ?x) (road ?x ?y) (not (= ?x ?y)))",
        "(and (at ?x) (road ?x ?y) (forall (?z) (or (not (at ?z)) (= ?z ?x))))",
        "(and (at ?x) (imply (at ?x) (road ?x ?y)))",
        "(and (at ?x) (exists (?z) (and (= ?z ?y) (road ?x ?z))))",
    ],
    ids=["nested and", "not", "equal", "forall", "imply", "exists"],
)
def test_conditions_of_every_form(precondition: str) -> None:
    domain = ROADS.replace("(and (at ?x) (road ?x ?y))", precondition, 1)
    objects = "(:objects a b c) (:init (at a) (road a b) (road b c)) (:goal (at c))"
    assert plan(domain, objects) == ["go a b", "go b c"]


def test_effects_under_a_condition() -> None:
    domain = """(:predicates (at ?x) (in ?p ?x))
        (:action go :parameters (?x ?y) :precondition (at ?x)
          :effect (and (at ?y) (not (at ?x))
            (forall (?p) (when (in ?p ?x) (and (in ?p ?y) (not (in ?p ?x)))))))"""
    problem = "(:objects a b p q) (:init (at a) (in p a)) (:goal (and (in p b) (not (in p a))))"
    assert plan(domain, problem) == ["go a b"]


def test_functions_metric_and_rules() -> None:
    domain = """(:predicates (at ?x) (near ?x))
        (:functions (total-cost) - number (toll ?x) - number)
        (:derived (near ?x) (at ?x))
        (:action go :parameters (?x ?y) :precondition (near ?x)
          :effect (and (at ?y) (not (at ?x)) (increase (total-cost) (toll ?y))))"""
    problem = """(:objects a b) (:init (at a) (= (toll a) 1) (= (toll b) 7) (= (total-cost) 0))
        (:goal (near b)) (:metric minimize (total-cost))"""
    task = text("t", domain, problem, None).task()
    answer = solve(task, lambda: False)
    assert isinstance(answer, Plan)
    assert answer.cost == 7


@pytest.mark.parametrize(
    ("init", "goal", "code", "words"),
    [
        ("(att a)", "(at b)", "PDDL_UNKNOWN", "predicate 'att' is not declared"),
        ("(at a b)", "(at b)", "PDDL_ARITY", "(at a b) has 2 arguments"),
        ("(at a)", "(at c)", "PDDL_UNKNOWN", "'c' is not declared"),
        ("(at c)", "(at b)", "PDDL_UNKNOWN", "'c' is not declared"),
        ("(at ?x)", "(at b)", "PDDL_UNKNOWN", "?x is not a parameter"),
    ],
    ids=["predicate", "arity", "object in goal", "object in init", "variable in init"],
)
def test_words_of_a_problem_that_mean_nothing(init: str, goal: str, code: str, words: str) -> None:
    found = refusal(ROADS, f"(:objects a b) (:init {init}) (:goal {goal})")
    assert found[0] == code
    assert words in found[1]


@pytest.mark.parametrize(
    ("condition", "code", "words"),
    [
        ("(and (at ?x) (road ?x ?z))", "PDDL_UNKNOWN", "?z is not a parameter"),
        ("(and (at ?x) (road ?x home))", "PDDL_UNKNOWN", "'home' is not declared"),
        ("(and (at ?x) (rode ?x ?y))", "PDDL_UNKNOWN", "predicate 'rode' is not declared"),
        ("(and (at ?x) (road ?x))", "PDDL_ARITY", "(road ?x) has 1 arguments"),
    ],
    ids=["variable", "constant", "predicate", "arity"],
)
def test_words_of_an_action_that_mean_nothing(condition: str, code: str, words: str) -> None:
    domain = ROADS.replace("(and (at ?x) (road ?x ?y))", condition, 1)
    found = refusal(domain, "(:objects a b) (:init (at a)) (:goal (at b))")
    assert found[0] == code
    assert words in found[1]


def test_an_argument_of_the_wrong_type() -> None:
    domain = """(:types cup ball) (:predicates (full ?c - cup))
        (:action fill :parameters (?b - ball) :precondition () :effect (full ?b))"""
    code, words = refusal(domain, "(:objects c - cup) (:init) (:goal (full c))")
    assert code == "PDDL_TYPE"
    assert all(name in words for name in ("cup", "?b", "ball"))


def test_an_object_that_is_a_constant_of_another_type() -> None:
    domain = """(:types cup ball) (:constants x - cup) (:predicates (full ?c - cup))
        (:action fill :parameters (?c - cup) :precondition () :effect (full ?c))"""
    code, words = refusal(domain, "(:objects x - ball) (:init) (:goal (full x))")
    assert code == "PDDL_TWICE"
    assert "'x'" in words


def test_a_parent_that_is_not_declared_is_a_type_all_the_same() -> None:
    domain = """(:types cup - vessel) (:predicates (full ?v - vessel))
        (:action fill :parameters (?v - vessel) :precondition () :effect (full ?v))"""
    assert plan(domain, "(:objects c - cup) (:init) (:goal (full c))") == ["fill c"]


SEEDED = """
import json, sys
from nondum.planning.ground.ground import ground
from nondum_pddl_workbench.standalone import load
from nondum.host.mind.native_planner import NativePlanner
from nondum_planner_pyperplan import PyperplanPlanner
loaded = load(*json.loads(sys.argv[1]))
task = ground(loaded.merged, loaded.facts, loaded.goal)
plans = [planner.plan(task, 30.0).steps for planner in (NativePlanner(), PyperplanPlanner())]
print(task.facts, [action.name for action in task.actions], plans)
"""


def test_the_hash_seed_changes_neither_task_nor_plan() -> None:
    balls = " ".join(f"b{n}" for n in range(4))
    domain = """(define (domain t) (:predicates (at ?r) (in ?b ?r) (ball ?b) (free) (held ?b))
      (:action move :parameters (?r ?s) :precondition (at ?r) :effect (and (at ?s) (not (at ?r))))
      (:action pick :parameters (?b ?r) :precondition (and (at ?r) (in ?b ?r) (free))
        :effect (and (held ?b) (not (in ?b ?r)) (not (free))))
      (:action drop :parameters (?b ?r) :precondition (and (at ?r) (held ?b))
        :effect (and (in ?b ?r) (free) (not (held ?b)))))"""
    placed = " ".join(f"(in b{n} r{n % 2}) (ball b{n})" for n in range(4))
    wanted = " ".join(f"(in b{n} r2)" for n in range(4))
    problem = (
        f"(define (problem p) (:domain t) (:objects {balls} r0 r1 r2)"
        f"(:init (at r0) (free) {placed}) (:goal (and {wanted})))"
    )
    said = {
        subprocess.run(
            [sys.executable, "-c", SEEDED, json.dumps([domain, "d", problem, "p"])],
            env={**os.environ, "PYTHONHASHSEED": seed},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for seed in ("0", "1", "2", "77")
    }
    assert len(said) == 1
    assert "move r0 r1" in said.pop()


def test_what_has_no_plan_is_proved_to_have_none() -> None:
    task = text(
        "t",
        ROADS,
        "(:objects a b c) (:init (at a) (road a b) (road a c)) (:goal (and (at b) (at c)))",
        None,
    ).task()
    assert solve(task, lambda: False) == Unsolvable("exhausted")
    assert PyperplanPlanner().plan(task, 30.0) == Unsolvable("exhausted")

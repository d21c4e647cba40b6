"""A component with too many ways to act is left out alone; the others are planned with."""

from __future__ import annotations

from contextlib import nullcontext

import pytest
from tests.kit.golden import Golden
from tests.planning.fragments import brings
from tests.planning.strangers import (
    MOBILE_BASE,
    PEOPLE_DETECTOR,
    RECORDED_CAMERA,
    ROVER,
    VISUAL_TRACKER,
    at_rest,
    components,
)

from nondum.planning.ground.bounds import INSTANCES_LIMIT, TooManyBindings
from nondum.planning.ground.ground import ground
from nondum.planning.ground.oversize import Fitted, fitted
from nondum.planning.merge.contribution import Contribution
from nondum.planning.merge.domain import Merged
from nondum.planning.merge.goal import parse_goal
from nondum.planning.merge.merge import merge
from nondum.planning.search import solve
from nondum.sdk.errors import Problem
from nondum.sdk.planner import GroundTask, Plan
from nondum_pddl_workbench import standalone

FOLLOW = "(following self person)"


def knobs(name: str, count: int, arguments: str, more: str = "") -> Contribution:
    """A unit with `count` knobs, which says that turning some of them makes the robot follow."""
    names = " ".join(f"{name}{number}" for number in range(count))
    body = f"""(:types {name}-knob - object) (:constants {names} - {name}-knob)
    (:action turn :parameters (?u - speaker {arguments} - {name}-knob ?h - host ?c - class)
      :precondition (and (ready ?u) {more}) :effect (following ?h ?c))"""
    return brings(name, body, units={"panel": "speaker"})


def fit(present: list[Contribution], goal: str = FOLLOW, limit: int = 2000) -> Fitted[GroundTask]:
    merged = merge(present, ROVER)
    assert not merged.quarantined, merged.quarantined
    facts = at_rest(present, merged)

    def make(found: Merged) -> GroundTask:
        return ground(found, facts, parse_goal(goal, found).expr, limit=limit)

    return fitted(present, merged, make)


def followers() -> list[Contribution]:
    return components([RECORDED_CAMERA, PEOPLE_DETECTOR, VISUAL_TRACKER, MOBILE_BASE])


def test_oversized_component_is_left_out_alone() -> None:
    found = fit([*followers(), knobs("wide", 30, "?x ?y ?z")])
    assert set(found.left_out) == {"wide"}
    assert found.left_out["wide"].code == "PDDL_TOO_MANY"
    assert "wide 1.0 domain.pddl" in found.left_out["wide"].where
    assert isinstance(solve(found.made, lambda: False), Plan)
    assert {action.plugin for action in found.merged.domain.actions.values()} == {
        c.plugin for c in followers()
    }


@pytest.mark.slow
def test_real_oversized_fragment_is_left_out_at_the_hosts_limit() -> None:
    found = fit([*followers(), knobs("wide", 60, "?x ?y ?z")], limit=INSTANCES_LIMIT)
    assert set(found.left_out) == {"wide"}


def test_bindings_that_are_looked_at_in_vain_count_too(golden: Golden) -> None:
    """Nothing is ever bound: all that is tried is excluded."""
    letters = [f"?{letter}" for letter in "klmpqrst"]
    never = "(or (reported ?c ?h) (exists (?t - target) (pointing ?h ?t)))"
    apart = " ".join(f"(not (= {a} {b}))" for a in letters for b in letters if a < b)
    in_vain = knobs("vain", 12, " ".join(letters), f"{apart} {never}")
    found = fit([*followers(), in_vain])
    assert set(found.left_out) == {"vain"}
    assert found.left_out["vain"].code == "PDDL_TOO_MANY"
    golden.check_line("a condition has too many bindings", found.left_out["vain"].message)


@pytest.mark.parametrize(("objects", "is_too_much"), [(10, False), (14, True)])
def test_bindings_that_are_not_needed_count_too(objects: int, is_too_much: bool) -> None:
    """All but one of 1,000 or 2,744: as many as may be looked at, if making one cost nothing."""
    names = [f"o{number}" for number in range(objects)]
    domain = """(define (domain knots) (:requirements :strips)
      (:predicates (rope ?x) (tied ?x ?y ?z))
      (:action tie :parameters (?x ?y ?z) :precondition (and (rope ?x) (rope ?y) (rope ?z))
        :effect (tied ?x ?y ?z)))"""
    problem = f"""(define (problem p) (:domain knots) (:objects {" ".join(names)})
      (:init {" ".join(f"(rope {name})" for name in names)}) (:goal (tied o0 o0 o0)))"""
    read = standalone.load(domain, "domain", problem, "problem")
    with pytest.raises(TooManyBindings) if is_too_much else nullcontext():
        task = ground(read.merged, read.facts, read.goal, limit=200)
        assert [action.name for action in task.actions] == ["tie o0 o0 o0"]


def test_derived_facts_count_too() -> None:
    body = """(:types pin - object) (:predicates (linked ?a ?b ?c - pin))
    (:derived (linked ?a ?b ?c - pin) (not (= ?a ?b)))
    (:action join :parameters (?u - speaker ?h - host ?c - class ?p - pin)
      :precondition (linked ?p ?p ?p) :effect (following ?h ?c))"""
    pins = " ".join(f"pin{number}" for number in range(20))
    wide = brings("wide", f"(:constants {pins} - pin) {body}", units={"panel": "speaker"})
    assert set(fit([*followers(), wide]).left_out) == {"wide"}


SIX = "?a ?b ?c ?d ?e ?f - pin"
SAYINGS = {
    "precondition": f"(forall ({SIX}) (or (up ?a) (near ?b ?c ?d) (up ?e) (up ?f)))",
    "some": f"(forall ({SIX}) (or (not (up ?a)) (not (near ?b ?c ?d)) (= ?e ?f)))",
    "nested": "(forall (?a - pin) (exists (?b - pin) (forall (?c - pin) (exists (?d - pin)"
    " (forall (?e ?f - pin) (or (up ?a) (near ?b ?c ?d) (near ?d ?e ?f)))))))",
}


def pins(saying: str, rule: str = "") -> Contribution:
    """A unit that makes the robot follow when something is so of its forty pins."""
    body = f"""(:types pin - object) (:constants {" ".join(f"pin{n}" for n in range(40))} - pin)
    (:predicates (up ?p - pin) (near ?p ?q ?r - pin) (well)) {rule}
    (:action lift :parameters (?u - speaker ?p ?q - pin) :precondition (ready ?u)
      :effect (and (up ?p) (near ?p ?q ?p)))
    (:action join :parameters (?u - speaker ?h - host ?c - class)
      :precondition (and (ready ?u) {saying}) :effect (following ?h ?c))"""
    return brings("pins", body, units={"panel": "speaker"})


@pytest.mark.parametrize("saying", SAYINGS.values(), ids=SAYINGS)
def test_who_quantifies_over_too_much_is_left_out_alone(saying: str) -> None:
    found = fit([*followers(), pins(saying)])
    assert set(found.left_out) == {"pins"}
    assert found.left_out["pins"].code == "PDDL_TOO_MANY"
    assert isinstance(solve(found.made, lambda: False), Plan)


def test_rule_that_quantifies_over_too_much_is_left_out_alone() -> None:
    rule = f"(:derived (well) {SAYINGS['precondition']})"
    assert set(fit([*followers(), pins("(well)", rule)]).left_out) == {"pins"}


def test_goal_that_quantifies_over_too_much_is_refused() -> None:
    with pytest.raises(TooManyBindings) as error:
        fit([*followers(), pins("")], SAYINGS["precondition"])
    assert "'the goal'" in error.value.problems[0].message


def test_who_is_merely_large_is_let_in_again() -> None:
    """While the huge one is bound in part only, the large one looks widest."""
    large = knobs("a-large", 11, "?x ?y ?z")
    huge = knobs("b-huge", 40, "?x ?y ?z")
    assert set(fit([*followers(), large, huge]).left_out) == {"b-huge"}


def test_all_that_are_oversized_are_left_out() -> None:
    both = [knobs("one", 30, "?x ?y ?z"), knobs("two", 40, "?x ?y ?z")]
    assert set(fit([*followers(), *both]).left_out) == {"one", "two"}


def test_what_no_goal_depends_on_does_no_harm() -> None:
    wide = knobs("wide", 30, "?x ?y ?z")
    streaming = f"(from {ROVER}__recorded-camera__frames self)"
    found = fit([wide, *components([RECORDED_CAMERA])], streaming)
    assert not found.left_out


def test_excess_without_a_component_to_leave_out_is_refused() -> None:
    def refuse(_: Merged) -> None:
        raise TooManyBindings(Problem("PDDL_TOO_MANY", "too many"), frozenset())

    with pytest.raises(TooManyBindings):
        fitted(followers(), merge(followers(), ROVER), refuse)

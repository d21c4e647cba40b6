"""A task written as PDDL is the same task when it is read again."""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable
from dataclasses import replace

import pytest
from tests.planning.differential.texts import TEXTS, Text, text
from tests.planning.fragments import HOST, brings

from nondum.planning.ground.ground import ground
from nondum.planning.ground.pddl_text import pddl_text
from nondum.planning.merge.goal import parse_goal
from nondum.planning.merge.merge import merge
from nondum.planning.pddl.wording import without_dots
from nondum.sdk.planner import GroundTask, PddlTask
from nondum_pddl_workbench.standalone import Standalone, load

EYE = """(:predicates (seen ?c - class ?h - host))
  (:action look :parameters (?u - camera ?c - class ?h - host)
    :precondition (and (ready ?u) (on ?u ?h)) :effect (seen ?c ?h))"""
CLASSES = "(:objects person - class)"


def shape(task: GroundTask) -> Hashable:
    """What a task says, by name; facts that stand for a disjunction are named after the place
    where it is written, and count as one name."""

    def named(facts: frozenset[int]) -> frozenset[str]:
        return frozenset(task.facts[fact].split("@")[0] for fact in facts)

    actions = Counter(
        (
            action.name,
            named(action.precondition),
            named(action.add),
            named(action.delete),
            action.cost,
            frozenset(
                (named(c.condition), named(c.add), named(c.delete)) for c in action.conditional
            ),
        )
        for action in task.actions
    )
    rules = Counter(
        (layer, named(frozenset((rule.head,))), named(rule.body))
        for layer, rules in enumerate(task.derived)
        for rule in rules.rules
    )
    return (
        frozenset(actions.items()),
        frozenset(rules.items()),
        named(task.init),
        named(task.goal),
    )


def written(loaded: Standalone) -> PddlTask:
    return pddl_text(loaded.merged, loaded.facts, loaded.goal)


def read_again(found: PddlTask) -> Standalone:
    return load(found.domain, "domain.pddl", found.problem, "problem.pddl")


@pytest.mark.parametrize("text", TEXTS, ids=str)
def test_what_is_written_is_the_same_task(text: Text) -> None:
    again = read_again(written(text.load()))
    assert shape(ground(again.merged, again.facts, again.goal)) == shape(text.task())


@pytest.mark.parametrize("text", TEXTS, ids=str)
def test_planners_need_not_know_either(text: Text) -> None:
    task = written(text.load())
    assert "(either" not in task.domain + task.problem


@pytest.mark.parametrize("text", TEXTS, ids=str)
def test_who_writes_twice_writes_the_same(text: Text) -> None:
    assert written(text.load()) == written(text.load())


def test_the_order_of_facts_changes_nothing() -> None:
    loaded = TEXTS[0].load()
    backwards = sorted(loaded.facts, reverse=True)
    assert pddl_text(loaded.merged, backwards, loaded.goal) == written(loaded)


def test_planners_that_insist_are_told_what_is_used() -> None:
    by_name = {text.name: written(text.load()).domain for text in TEXTS}
    assert "(:requirements :strips :typing :negative-preconditions)" in by_name["strips"]
    assert ":conditional-effects" in by_name["conditional-effects"]
    assert ":derived-predicates" in by_name["derived"]
    assert ":action-costs" in by_name["costs"]
    assert ":equality" in by_name["equality"]


def test_an_action_with_an_unknown_cost_cannot_be_planned_with() -> None:
    domain = written(next(t for t in TEXTS if t.name == "costs").load()).domain
    assert "(known-far ?p ?q)" in domain


def test_a_merged_domain_can_be_written_without_dots() -> None:
    merged = merge([brings("eye", EYE, CLASSES, units={"left": "camera"})], HOST)
    goal = parse_goal("(seen person self)", merged)
    unit = f"{HOST}__eye__left"
    facts = [f"ready {unit}", f"on {unit} {HOST}"]
    again = read_again(pddl_text(merged, facts, goal.expr, spelled=without_dots))
    task = ground(again.merged, again.facts, again.goal)
    own = ground(merged, facts, goal.expr)
    assert [action.name for action in task.actions] == [f"eye__look {unit} person {HOST}"]
    assert [action.name for action in own.actions] == [f"eye.look {unit} person {HOST}"]


def test_names_are_those_of_the_ground_task_unless_told_otherwise() -> None:
    merged = merge([brings("eye", EYE, CLASSES, units={"left": "camera"})], HOST)
    found = pddl_text(merged, [], parse_goal("(seen person self)", merged).expr)
    assert "(:action eye.look" in found.domain


def test_names_that_would_be_alike_stay_apart() -> None:
    loaded = TEXTS[0].load()
    actions = loaded.merged.domain.actions
    doubled = {name: replace(actions["go"], name=name) for name in ("a.go", "a__go", "go")}
    merged = replace(loaded.merged, domain=replace(loaded.merged.domain, actions=doubled))
    found = pddl_text(merged, loaded.facts, loaded.goal, spelled=without_dots)
    assert [line for line in found.domain.splitlines() if "(:action" in line] == [
        "(:action a__go_",
        "(:action a__go",
        "(:action go",
    ]


def test_a_goal_about_something_gone_is_still_a_goal() -> None:
    loaded = TEXTS[0].load()
    objects = {name: o for name, o in loaded.merged.objects.items() if name != "c"}
    found = pddl_text(replace(loaded.merged, objects=objects), loaded.facts, loaded.goal)
    again = read_again(found)
    assert not ground(again.merged, again.facts, again.goal).actions


def test_an_object_of_two_types_is_of_both() -> None:
    several = text(
        "two-types",
        """(:types a b)
           (:predicates (p ?x - a) (q ?x - b))
           (:action do :parameters (?x - a) :precondition (and) :effect (p ?x))
           (:action make :parameters (?x - b) :precondition (and) :effect (q ?x))""",
        """(:objects x - (either a b) y - a) (:init) (:goal (and (p x) (q x)))""",
        2,
    )
    again = read_again(written(several.load()))
    assert shape(ground(again.merged, again.facts, again.goal)) == shape(several.task())


def test_where_nothing_is_true_it_is_said() -> None:
    loaded = TEXTS[0].load()
    assert "(:init)" in pddl_text(loaded.merged, [], loaded.goal).problem


def test_what_may_be_of_a_type_with_two_parents_may_be_spoken_of() -> None:
    several = text(
        "perhaps",
        """(:types a b - object c - (either a b))
           (:predicates (p ?x - c) (q))
           (:constants x - a y - b)
           (:action do :parameters () :precondition (and (not (p x)) (not (p y))) :effect (q))""",
        """(:init) (:goal (q))""",
        1,
    )
    again = read_again(written(several.load()))
    assert shape(ground(again.merged, again.facts, again.goal)) == shape(several.task())

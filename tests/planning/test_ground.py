"""Grounding finds exactly the actions that can be reached and can help."""

from __future__ import annotations

import random
from collections.abc import Iterable
from itertools import product

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.planning.fragments import HOST, brings

from nondum.planning.ground.delete_relaxation import quick_answer
from nondum.planning.ground.exploration import explore
from nondum.planning.ground.ground import ground
from nondum.planning.merge.domain import Merged
from nondum.planning.merge.goal import parse_goal
from nondum.planning.merge.merge import merge
from nondum.planning.pddl.facts import holds, is_twin, twin
from nondum.sdk.errors import FragmentRefused
from nondum.sdk.planner import AlreadyTrue, GroundAction, GroundTask, Unsolvable

WORDS = """(:constants a b c - place red - class)
           (:predicates (at ?u - base ?p - place) (open ?p - place) (done ?u) (link ?p ?q - place)
                        (tagged ?x - (either place class)))"""
UNITS = {"left": "base", "right": "base"}
LEFT, RIGHT = "rover__drive__left", "rover__drive__right"


def merged(actions: str, units: dict[str, str] | None = None) -> Merged:
    result = merge([brings("drive", WORDS + actions, units=units or UNITS)], HOST)
    assert not result.quarantined, result.quarantined
    return result


def task(actions: str, facts: Iterable[str], goal: str) -> GroundTask:
    result = merged(actions)
    return ground(result, facts, parse_goal(goal, result).expr)


def names(grounded: GroundTask) -> list[str]:
    return [
        action.name.removeprefix("drive.").replace("rover__drive__", "")
        for action in grounded.actions
    ]


def facts_of(grounded: GroundTask, indices: Iterable[int]) -> set[str]:
    return {grounded.facts[index] for index in indices}


def only(grounded: GroundTask) -> GroundAction:
    [action] = grounded.actions
    return action


MOVE = """(:action move :parameters (?u - base ?p ?q - place)
            :precondition (and (ready ?u) (at ?u ?p) (link ?p ?q))
            :effect (and (not (at ?u ?p)) (at ?u ?q)))"""
ROAD = ["link a b", "link b c", f"ready {LEFT}", f"ready {RIGHT}"]


def test_only_reachable_bindings_are_made() -> None:
    grounded = task(MOVE, [*ROAD, f"at {LEFT} a"], "(at left c)".replace("left", LEFT))
    assert names(grounded) == ["move left a b", "move left b c"]


def test_static_facts_stay_in_preconditions() -> None:
    grounded = task(MOVE, [*ROAD, f"at {LEFT} b"], f"(at {LEFT} c)")
    action = only(grounded)
    assert facts_of(grounded, action.precondition) == {
        f"at {LEFT} b",
        f"ready {LEFT}",
        "link b c",
    }


def test_actions_that_cannot_help_are_left_out() -> None:
    facts = [*ROAD, f"at {LEFT} a", f"at {RIGHT} a"]
    grounded = task(MOVE, facts, f"(at {LEFT} b)")
    assert all(LEFT in action.name for action in grounded.actions)


def test_facts_about_absent_objects_are_left_out() -> None:
    grounded = task(MOVE, [*ROAD, f"at {LEFT} b", "link b moon", "link moon c"], f"(at {LEFT} c)")
    assert names(grounded) == ["move left b c"]


def test_objects_may_be_added() -> None:
    result = merged(MOVE)
    goal = parse_goal(f"(at {LEFT} c)", result).expr
    facts = [f"ready {LEFT}", f"at {LEFT} a", "link a yard", "link yard c"]
    assert not ground(result, facts, goal).actions
    assert len(ground(result, facts, goal, {"yard": ("place",)}).actions) == 2


def test_order_of_facts_does_not_matter() -> None:
    facts = [*ROAD, f"at {LEFT} a", f"at {RIGHT} b"]
    tasks = []
    for seed in range(5):
        random.Random(seed).shuffle(facts)
        tasks.append(task(MOVE, facts, f"(at {LEFT} c)"))
    assert all(grounded == tasks[0] for grounded in tasks)


def test_constants_stand_for_themselves() -> None:
    actions = """(:action go :parameters (?u - base) :precondition (at ?u a) :effect (at ?u b))"""
    assert names(task(actions, [f"at {LEFT} a", f"at {RIGHT} c"], f"(at {LEFT} b)")) == ["go left"]


def test_equality_is_tested_on_bindings() -> None:
    same = """(:action p :parameters (?u - base ?p ?q - place)
                :precondition (= ?p ?q) :effect (link ?p ?q))"""
    other = same.replace("(= ?p ?q)", "(not (= ?p ?q))")
    constant = same.replace("(= ?p ?q)", "(and (= ?p a) (not (= ?q b)))")
    goal = "(and " + " ".join(f"(link {p} {q})" for p, q in product("abc", repeat=2)) + ")"
    assert {n.split()[2] == n.split()[3] for n in names(task(same, [], goal))} == {True}
    assert len(names(task(other, [], goal))) == 2 * 6
    assert {tuple(n.split()[2:]) for n in names(task(constant, [], goal))} == {
        ("a", "a"),
        ("a", "c"),
    }


def test_either_takes_both_types() -> None:
    actions = (
        """(:action tag :parameters (?u - base ?x - (either place class)) :effect (tagged ?x))"""
    )
    goal = "(and (tagged a) (tagged red))"
    assert len(names(task(actions, [], goal))) == 4


CLOSE = """(:action shut :parameters (?u - base ?p - place)
             :precondition (not (at ?u ?p)) :effect (not (open ?p)))"""


def test_negative_condition_becomes_a_twin() -> None:
    grounded = task(
        MOVE + CLOSE, [*ROAD, f"at {LEFT} a", f"at {RIGHT} c", "open a"], "(not (open a))"
    )
    shut = next(a for a in grounded.actions if a.name == f"drive.shut {LEFT} a")
    assert facts_of(grounded, shut.precondition) == {f"!at {LEFT} a"}
    assert facts_of(grounded, shut.add) == {"!open a"}
    assert facts_of(grounded, grounded.goal) == {"!open a"}
    leave = next(a for a in grounded.actions if a.name == f"drive.move {LEFT} a b")
    assert f"!at {LEFT} a" in facts_of(grounded, leave.add)
    assert f"at {LEFT} b" in facts_of(grounded, leave.add)


def test_twins_begin_as_the_closed_world_says() -> None:
    grounded = task(MOVE + CLOSE, [*ROAD, f"at {LEFT} a", "open a"], "(not (open a))")
    initial = facts_of(grounded, grounded.init)
    for text in grounded.facts:
        if is_twin(text):
            assert (text in initial) != (twin(text) in initial)
            assert holds(text, initial) == (text in initial)


JUMP = """(:functional at)
          (:action jump :parameters (?u - base ?q - place) :precondition (ready ?u)
            :effect (at ?u ?q))"""


def test_functional_predicate_takes_its_other_values_away() -> None:
    grounded = task(JUMP, [f"at {LEFT} a", f"ready {LEFT}"], f"(at {LEFT} b)")
    jump = only(grounded)
    taken = facts_of(grounded, jump.delete)
    assert f"at {LEFT} a" in taken
    assert f"at {LEFT} b" not in taken


def test_functional_predicate_leaves_by_taking_another_value() -> None:
    grounded = task(JUMP, [f"at {LEFT} a", f"ready {LEFT}"], f"(not (at {LEFT} a))")
    assert names(grounded) == ["jump left b", "jump left c"]
    assert quick_answer(grounded) is None


def test_static_negative_condition_is_decided() -> None:
    grounded = task(CLOSE, [f"at {LEFT} a", f"at {RIGHT} a", "open a"], "(not (open a))")
    assert not grounded.actions


def test_adding_wins_over_deleting() -> None:
    actions = """(:action touch :parameters (?u - base ?p - place)
                   :effect (and (not (open ?p)) (open ?p)))"""
    grounded = task(actions, [], "(open a)")
    assert all(not action.delete for action in grounded.actions)


def test_cost_is_kept() -> None:
    actions = (
        "(:action go :parameters (?u - base) :effect (and (done ?u) (increase (total-cost) 7)))"
    )
    assert [a.cost for a in task(actions, [], f"(done {LEFT})").actions] == [7]


def test_goal_of_different_objects_as_one_is_impossible() -> None:
    grounded = task(MOVE, [], "(= a b)")
    assert quick_answer(grounded) == Unsolvable("relaxed", ("= a b",))
    assert quick_answer(task(MOVE, [], "(= a a)")) == AlreadyTrue()
    assert quick_answer(task(MOVE, [], "(not (= a a))")) == Unsolvable("relaxed", ("= a a",))


def test_goal_that_holds_is_already_true() -> None:
    assert quick_answer(task(MOVE, [f"at {LEFT} a"], f"(at {LEFT} a)")) == AlreadyTrue()


def test_unreachable_goal_is_proved_so() -> None:
    answer = quick_answer(task(MOVE, [*ROAD, f"at {LEFT} b"], f"(and (at {LEFT} a) (at {LEFT} c))"))
    assert answer == Unsolvable("relaxed", (f"at {LEFT} a",))


def test_reachable_goal_needs_a_search() -> None:
    assert quick_answer(task(MOVE, [*ROAD, f"at {LEFT} a"], f"(at {LEFT} c)")) is None


@pytest.mark.slow
def test_action_that_binds_everything_is_refused() -> None:
    wide = "(:action w :parameters (?u - base ?a ?b ?c ?d ?e ?f ?g ?h ?i) :effect (done ?u))"
    with pytest.raises(FragmentRefused, match=r"'drive\.w'") as refused:
        task(wide, [], f"(done {LEFT})")
    assert refused.value.problems[0].where.startswith("drive 1.0 domain.pddl:")


# Against a grounder that tries everything

VARIABLES = ("?u", "?p", "?q")
ATOMS = [
    "(at ?u ?p)",
    "(at ?u ?q)",
    "(at ?u a)",
    "(open ?p)",
    "(open ?q)",
    "(link ?p ?q)",
    "(link ?q ?p)",
    "(link ?p b)",
    "(done ?u)",
    "(tagged ?q)",
    "(tagged red)",
]


def conjunctions(smallest: int) -> st.SearchStrategy[list[str]]:
    return st.lists(st.sampled_from(ATOMS), min_size=smallest, max_size=4, unique=True)


FACTS = [
    *(f"at {u} {p}" for u in (LEFT, RIGHT) for p in "abc"),
    *(f"open {p}" for p in "abc"),
    *(f"link {p} {q}" for p in "abc" for q in "abc"),
]


@given(
    st.lists(st.tuples(conjunctions(0), conjunctions(1)), min_size=1, max_size=3),
    st.sets(st.sampled_from(FACTS), max_size=6),
)
def test_join_finds_what_trying_everything_finds(
    schemas: list[tuple[list[str], list[str]]], facts: set[str]
) -> None:
    actions = " ".join(
        f"(:action x{i} :parameters (?u - base ?p ?q - place)"
        f" :precondition (and {' '.join(pre)}) :effect (and {' '.join(add)}))"
        for i, (pre, add) in enumerate(schemas)
    )
    found = explore(merged(actions), facts)
    assert (set(i.name for i in found.instances), found.reachable) == everything(schemas, facts)


def everything(
    schemas: list[tuple[list[str], list[str]]], facts: set[str]
) -> tuple[set[str], frozenset[str]]:
    reached, fired = set(facts), set[str]()
    while True:
        before = len(reached), len(fired)
        for (i, (pre, add)), u, p, q in product(enumerate(schemas), (LEFT, RIGHT), "abc", "abc"):
            bound = {"?u": u, "?p": p, "?q": q}
            if all(filled(atom, bound) in reached for atom in pre):
                fired.add(f"drive.x{i} {u} {p} {q}")
                reached |= {filled(atom, bound) for atom in add}
        if (len(reached), len(fired)) == before:
            return fired, frozenset(reached)


def filled(atom: str, bound: dict[str, str]) -> str:
    return " ".join(bound.get(word, word) for word in atom.strip("()").split())

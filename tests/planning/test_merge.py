"""Strangers' words become one domain, or a conflict is named and kept out."""

from __future__ import annotations

from importlib import resources
from itertools import permutations

import pytest
from tests.kit.golden import Golden
from tests.planning.fragments import HOST, brings

from nondum.planning.merge.contribution import Contribution
from nondum.planning.merge.core import core, core_value_types
from nondum.planning.merge.domain import Merged
from nondum.planning.merge.merge import merge
from nondum.planning.pddl.parse import parse_fragment
from nondum.planning.pddl.syntax import DomainFragment
from nondum.sdk.description import Behaviour, Fragment, PluginDescription, Unit
from nondum.sdk.errors import Problem
from nondum.sdk.messages import MESSAGES
from nondum.sdk.valued import value_types


def merged(*contributions: Contribution) -> Merged:
    result = merge(contributions, HOST)
    assert not result.quarantined, result.quarantined
    return result


def refused(*contributions: Contribution) -> Problem:
    """The first problem of the last contribution, which alone is kept out."""
    result = merge(contributions, HOST)
    assert list(result.quarantined) == [contributions[-1].component]
    return result.quarantined[contributions[-1].component][0]


# One component by itself

ALONE = {
    "undeclared type": (
        "(:constants a - rom)",
        "PDDL_UNKNOWN",
        "a - rom",
        "type 'rom' is not declared",
    ),
    "undeclared predicate": (
        "(:action go :parameters (?u - base) :precondition (redy ?u))",
        "PDDL_UNKNOWN",
        "redy",
        "predicate 'redy' is not declared",
    ),
    "unbound variable": (
        "(:action go :parameters (?u - base) :precondition (ready ?v))",
        "PDDL_UNKNOWN",
        "?v",
        "?v is not a parameter",
    ),
    "undeclared object": (
        "(:action go :parameters (?u - base) :precondition (recognises ?u goose))",
        "PDDL_UNKNOWN",
        "goose",
        "'goose' is not declared",
    ),
    "wrong arity": (
        "(:action go :parameters (?u - base) :precondition (on ?u))",
        "PDDL_ARITY",
        "on ?u",
        "(on ?u) has 1 arguments, (on ?1 - unit ?2 - host) is declared",
    ),
    "wrong type": (
        "(:action go :parameters (?u - base) :precondition (flowing ?u))",
        "PDDL_TYPE",
        "?u))",
        "expected stream, ?u is base",
    ),
    "no actor": (
        "(:action go :parameters (?h - host))",
        "PDDL_ACTOR",
        "?h - host",
        "the first parameter of 'go' is not a unit",
    ),
    "no parameters": ("(:action go)", "PDDL_ACTOR", "go)", "is not a unit"),
    "writes a host's word": (
        "(:action go :parameters (?u - base) :effect (ready ?u))",
        "PDDL_OWNED",
        "ready",
        "'ready' is the host's to say",
    ),
    "gives back by itself": (
        "(:action go :parameters (?u - base) :effect (idle ?u))",
        "PDDL_OWNED",
        "idle",
        "'idle' is the host's to say",
    ),
    "deletes readiness": (
        "(:action go :parameters (?u - base) :effect (not (ready ?u)))",
        "PDDL_OWNED",
        "ready",
        "'ready' is the host's to say",
    ),
    "names self in an action": (
        "(:action go :parameters (?u - base) :precondition (on ?u self))",
        "PDDL_INSTANCE",
        "self",
        "'self' names one instance",
    ),
    "names its own unit in an action": (
        "(:action go :parameters (?u - base) :precondition (ready wheels))",
        "PDDL_INSTANCE",
        "wheels",
        "'wheels' names one instance",
    ),
    "unknown word in a disjunction": (
        "(:action go :parameters (?u - base) :precondition (or (ready ?u) (idel ?u)))",
        "PDDL_UNKNOWN",
        "idel",
        "predicate 'idel' is not declared",
    ),
    "unknown type of a quantified variable": (
        "(:action go :parameters (?u - base) :precondition (forall (?x - unti) (idle ?x)))",
        "PDDL_UNKNOWN",
        "?x",
        "type 'unti' is not declared",
    ),
    "variable outside its quantifier": (
        "(:action go :parameters (?u - base) :precondition"
        " (and (exists (?x - unit) (idle ?x)) (ready ?x)))",
        "PDDL_UNKNOWN",
        "?x",
        "?x is not a parameter",
    ),
    "host's word under a condition": (
        "(:action go :parameters (?u - base) :effect (when (idle ?u) (ready ?u)))",
        "PDDL_OWNED",
        "ready",
        "'ready' is the host's to say",
    ),
    "cost under a condition": (
        "(:action go :parameters (?u - base) :effect (when (ready ?u) (increase (total-cost) 1)))",
        "PDDL_UNSUPPORTED",
        "increase",
        "a cost that depends on a condition",
    ),
    "rule for the host's word": (
        "(:derived (ready ?u - unit) (idle ?u))",
        "PDDL_OWNED",
        "ready",
        "'ready' is the host's to say",
    ),
    "rule and action for one word": (
        "(:predicates (up ?u - unit)) (:derived (up ?v - unit) (idle ?v))"
        " (:action go :parameters (?u - base) :effect (up ?u))",
        "PDDL_DERIVED",
        "up ?v",
        "'up' follows from rules in one place and is written in another",
    ),
    "word that holds if it does not": (
        "(:predicates (up ?u - unit)) (:derived (up ?v - unit) (not (up ?v)))",
        "PDDL_DERIVED",
        "up ?v",
        "these hold only if they do not: up",
    ),
    "undeclared function": (
        "(:action go :parameters (?u - base) :effect (increase (total-cost) (weight ?u)))",
        "PDDL_UNKNOWN",
        "weight",
        "function 'weight' is not declared",
    ),
    "numeric effect": (
        "(:action go :parameters (?u - base) :effect (decrease (fuel) 1))",
        "PDDL_UNSUPPORTED",
        "decrease",
        "numeric effect (decrease (fuel) 1)",
    ),
    "effect as condition": (
        "(:predicates (up)) (:action go :parameters (?u - base) :precondition (when (up) (up)))",
        "PDDL_MISPLACED",
        "when",
        "'when' belongs in an effect",
    ),
    "condition as effect": (
        "(:predicates (up)) (:action go :parameters (?u - base) :effect (or (up) (up)))",
        "PDDL_MISPLACED",
        "or",
        "'or' is not an effect",
    ),
    "action twice": (
        "(:action go :parameters (?u - base)) (:action go :parameters (?u - base))",
        "PDDL_TWICE",
        "go :parameters (?u - base)))",
        "action 'go' is declared twice",
    ),
    "circle of types": (
        "(:types a - b b - a)",
        "PDDL_TYPE_CYCLE",
        "a - b",
        "types in a circle: a - b, b - a",
    ),
    "parent of object": ("(:types object - x)", "PDDL_TYPE_CYCLE", "object", "above all"),
    "core type elsewhere": (
        "(:types camera - sensor)",
        "PDDL_TYPE_PARENT",
        "camera",
        "in the core, 'camera' is a kind of unit",
    ),
    "core predicate otherwise": (
        "(:predicates (ready ?u ?v))",
        "PDDL_ARITY",
        "ready",
        "predicate 'ready': 2 arguments, 1 as nondum-core",
    ),
    "core predicate of another type": (
        "(:predicates (ready ?u - place))",
        "PDDL_SIGNATURE",
        "ready",
        "argument 1: place, unit as nondum-core",
    ),
    "value of nothing": (
        "(:valued dose)",
        "PDDL_UNKNOWN",
        "dose",
        "'dose' in :valued is no predicate",
    ),
    "value of no message type": (
        "(:predicates (seen ?h - host)) (:valued seen - pos)",
        "PDDL_TYPE",
        "seen",
        "the value of 'seen' is of no message type: pos",
    ),
    "value of two types": (
        "(:predicates (seen ?h - host)) (:valued seen - (either pose twist))",
        "PDDL_TYPE",
        "seen",
        "of no message type: (either pose twist)",
    ),
    "object of another component": (
        "(:constants rover__camera__lens - camera)",
        "PDDL_OWNED",
        "rover__",
        "has the form of another component's unit",
    ),
    "own unit of another type": (
        "(:constants wheels - camera)",
        "PDDL_OBJECT_TYPE",
        "wheels",
        "'wheels' is base, not camera",
    ),
}


@pytest.mark.parametrize(("body", "code", "culprit", "message"), ALONE.values(), ids=ALONE)
def test_wrong_fragment_keeps_its_component_out(
    body: str, code: str, culprit: str, message: str
) -> None:
    found = refused(brings("drive", body, units={"wheels": "base"}))
    assert found.code == code
    assert message in found.message
    _, line, caret = found.message.splitlines()
    column = caret.index("^")
    assert line[column:].startswith(culprit)
    assert found.where == f"drive 1.0 domain.pddl:1:{column + 1}"


INITS = {
    "host's word": ("(:init (ready wheels))", "PDDL_OWNED", "'ready' is the host's to say"),
    "no fact": ("(:init (not (found goose self)))", "PDDL_INIT", "is not a fact"),
    "half a number": ("(:init (= (weight wheels) 1.5))", "PDDL_INIT", "only whole numbers"),
    "number of nothing": ("(:init (= wheels 1))", "PDDL_INIT", "gives no function a number"),
    "unknown function": ("(:init (= (wait wheels) 1))", "PDDL_UNKNOWN", "function 'wait'"),
    "wrong type": ("(:init (found self self))", "PDDL_TYPE", "expected class, self is host"),
    "variable": ("(:init (recognises ?u person))", "PDDL_UNKNOWN", "?u is not a parameter"),
    "stranger's unit": (
        "(:init (recognises rover__detector__hog goose))",
        "PDDL_OWNED",
        "another component's unit",
    ),
    "goal": ("(:goal (ready wheels))", "PDDL_GOAL", "a fragment has no goal"),
}


@pytest.mark.parametrize(("init", "code", "message"), INITS.values(), ids=INITS)
def test_wrong_problem_keeps_its_component_out(init: str, code: str, message: str) -> None:
    found = refused(brings("drive", init=init, units={"wheels": "base"}))
    assert found.code == code
    assert message in found.message


def test_lasting_behaviour_has_no_effects_under_conditions(golden: Golden) -> None:
    body = """(:predicates (up)) (:action go :parameters (?u - base)
              :effect (and (not (idle ?u)) (when (ready ?u) (up))))"""
    behaviour = Behaviour("go", "(go ?u - base)", lasting=True)
    found = refused(brings("drive", body, units={"wheels": "base"}, behaviours=(behaviour,)))
    assert found.code == "PDDL_UNSUPPORTED"
    golden.check_line("a lasting action has conditional effects", found.message)


def test_stranger_may_not_write_what_follows_from_another_ones_rules() -> None:
    rule = "(:predicates (up ?u - unit)) (:derived (up ?u - unit) (idle ?u))"
    writer = "(:predicates (up ?u - unit)) (:action go :parameters (?u - base) :effect (up ?u))"
    result = merge([brings("arm", rule), brings("base", writer)], HOST)
    [problem] = result.quarantined["base"]
    assert problem.code == "PDDL_DERIVED"
    assert problem.where.startswith("base 1.0 domain.pddl:1:")
    assert "arm 1.0 domain.pddl:1:" in problem.message


def test_circle_through_two_strangers_rules_keeps_the_later_one_out(golden: Golden) -> None:
    words = "(:predicates (up) (down))"
    first = brings("arm", words + "(:derived (up) (not (down)))")
    second = brings("base", words + "(:derived (down) (not (up)))")
    assert merge([first], HOST).quarantined == {}
    result = merge([second, first], HOST)
    [problem] = result.quarantined["base"]
    assert problem.code == "PDDL_DERIVED"
    golden.check_line("derived facts contradict each other", problem.message)


def test_values_of_functions_are_kept() -> None:
    functions = "(:functions (weight ?u - unit) (total-cost))"
    result = merge(
        [
            brings(
                "drive", functions, init="(:init (= (weight wheels) 7))", units={"wheels": "base"}
            )
        ],
        HOST,
    )
    assert result.values == {"weight rover__drive__wheels": 7}


def test_all_problems_are_told_at_once() -> None:
    body = "(:action go :parameters (?u - base) :precondition (and (a) (b)) :effect (c))"
    result = merge([brings("drive", body)], HOST)
    assert len(result.quarantined["drive"]) == 3


def test_nearest_name_is_suggested() -> None:
    body = "(:action go :parameters (?u - base) :precondition (redy ?u))"
    assert "'ready'" in refused(brings("drive", body)).fix


def test_syntax_error_names_its_plugin() -> None:
    assert refused(brings("drive", "(:typos)")).where == "drive 1.0 domain.pddl:1:25"


def test_undeclared_parent_is_taken_with_a_warning() -> None:
    result = merged(brings("drive", "(:types cart - vehicle)"))
    assert result.domain.types.is_kind_of("cart", "vehicle")
    assert result.warnings[0].code == "PDDL_UNKNOWN"
    assert "'vehicle'" in result.warnings[0].message


def test_mistakes_beyond_measure_are_cut_off() -> None:
    atoms = " ".join(f"(unknown-{i})" for i in range(5000))
    body = f"(:action go :parameters (?u - base) :precondition (and {atoms}))"
    assert len(merge([brings("drive", body)], HOST).quarantined["drive"]) == 50


def test_action_with_very_many_parameters_is_refused() -> None:
    parameters = " ".join(f"?p{i} - place" for i in range(40))
    found = refused(brings("drive", f"(:action go :parameters (?u - base {parameters}))"))
    assert found.code == "PDDL_TOO_MANY"


def test_very_many_types_are_refused() -> None:
    chain = " ".join(f"t{i} - t{i + 1}" for i in range(5000))
    assert refused(brings("drive", f"(:types {chain} t5000)")).code == "PDDL_TOO_MANY"


# Lasting and finishing behaviours

GO = "(:action go :parameters (?u - base) :precondition (idle ?u) :effect (not (idle ?u)))"


def test_lasting_behaviour_may_take_its_unit() -> None:
    result = merged(brings("drive", GO, behaviours=(Behaviour("go", "(go ?u - base)", True),)))
    assert result.lasting() == {"drive.go"}
    assert result.action("drive.go").behaviour == "go"


def test_finishing_behaviour_may_not_take_anything(golden: Golden) -> None:
    found = refused(brings("drive", GO, behaviours=(Behaviour("go", "(go ?u - base)"),)))
    assert found.code == "PDDL_OWNED"
    golden.check_line("a finishing behaviour takes a unit", found.message)


BEHAVIOURS = {
    "other parameters": ((Behaviour("go", "(go ?b - base)", True),), "has (?u - base)"),
    "other action": (
        (Behaviour("go", "(goo ?u - base)", True),),
        "no fragment declares its action 'goo'",
    ),
    "none": ((), "no behaviour carries out action 'go'"),
    "two": (
        (Behaviour("go", "(go ?u - base)", True), Behaviour("run", "(go ?u - base)", True)),
        "'go' and 'run' carry out 'go'",
    ),
    "unreadable": ((Behaviour("go", "go ?u", True),), "expected '('"),
}


@pytest.mark.parametrize(("behaviours", "message"), BEHAVIOURS.values(), ids=BEHAVIOURS)
def test_behaviours_and_actions_must_agree(behaviours: tuple[Behaviour, ...], message: str) -> None:
    result = merge([brings("drive", GO, behaviours=behaviours)], HOST)
    assert any(message in str(problem) for problem in result.quarantined["drive"])


# Two strangers

CONFLICTS = {
    "arity": (
        "(:predicates (at ?u - base ?p - place))",
        "(:predicates (at ?u - base))",
        "PDDL_ARITY",
        "predicate 'at': 1 arguments here, 2 in a 1.0 domain.pddl:1:34",
    ),
    "predicate types": (
        "(:predicates (at ?u - base))",
        "(:predicates (at ?u - place))",
        "PDDL_SIGNATURE",
        "argument 1: place here, base in a 1.0",
    ),
    "types of values": (
        "(:predicates (seen ?h - host)) (:valued seen - pose)",
        "(:predicates (seen ?h - host)) (:valued seen - gps-fix)",
        "PDDL_SIGNATURE",
        "predicate 'seen': its value is a gps-fix here, a pose in a 1.0",
    ),
    "parents": (
        "(:types rotor - base)",
        "(:types rotor - arm)",
        "PDDL_TYPE_PARENT",
        "type 'rotor' is a kind of arm here, of base in a 1.0",
    ),
    "circle": (
        "(:types x - y y)",
        "(:types y - x x)",
        "PDDL_TYPE_CYCLE",
        "x - y, y - x",
    ),
    "object types": (
        "(:constants goose - class)",
        "(:constants goose - target)",
        "PDDL_OBJECT_TYPE",
        "'goose' is target here, class in a 1.0",
    ),
}


@pytest.mark.parametrize(("first", "second", "code", "message"), CONFLICTS.values(), ids=CONFLICTS)
def test_conflict_names_both_and_keeps_one_out(
    first: str, second: str, code: str, message: str
) -> None:
    found = refused(brings("a", first), brings("b", second))
    assert found.code == code
    assert found.where.startswith("b 1.0 domain.pddl:1:")
    assert message in found.message


def test_rank_decides_before_name() -> None:
    first, second = CONFLICTS["arity"][:2]
    result = merge([brings("a", first, rank=1), brings("b", second, rank=0)], HOST)
    assert list(result.quarantined) == ["a"]


def test_conflict_with_one_that_is_kept_out_is_none() -> None:
    first, second = CONFLICTS["arity"][:2]
    result = merge([brings("a", first), brings("b", second), brings("c", second)], HOST)
    assert list(result.quarantined) == ["b", "c"]
    without = merge([brings("b", second), brings("c", second)], HOST)
    assert not without.quarantined


def test_more_specific_parent_is_kept() -> None:
    for bodies in permutations(["(:types cart - base)", "(:types cart - unit)", "(:types cart)"]):
        result = merged(*(brings(name, b) for name, b in zip("abc", bodies, strict=True)))
        assert result.domain.types.parents["cart"] == {"base"}


def test_predicate_is_one_whatever_its_variables_are_called() -> None:
    result = merged(
        brings("a", "(:predicates (at ?u - base ?p - place))"),
        brings("b", "(:predicates (at ?x - base ?where - place))"),
    )
    assert [origin.component for origin in result.domain.predicates["at"].origins] == ["a", "b"]
    assert not result.warnings


def test_wider_predicate_is_kept_with_a_warning(golden: Golden) -> None:
    result = merged(
        brings("a", "(:predicates (at ?u - base))"), brings("b", "(:predicates (at ?u - unit))")
    )
    assert result.domain.predicates["at"].parameters == (("unit",),)
    golden.check_line("a predicate is declared wider elsewhere", result.warnings[0].message)


def test_more_specific_type_of_a_shared_object_is_kept() -> None:
    result = merged(
        brings("a", "(:constants door - place)"), brings("b", "(:constants door - object)")
    )
    assert result.objects["door"].types == ("place",)
    assert [origin.component for origin in result.objects["door"].origins] == ["a", "b"]


def test_same_action_name_of_two_plugins_is_no_conflict() -> None:
    result = merged(brings("a", GO), brings("b", GO))
    assert sorted(result.domain.actions) == ["a.go", "b.go"]


def test_two_instances_share_one_schema() -> None:
    left = brings("drive", GO, component="left", units={"wheels": "base"})
    right = brings("drive", GO, component="right", units={"wheels": "base"})
    result = merged(left, right)
    assert list(result.domain.actions) == ["drive.go"]
    actor = result.action("drive.go").parameters[0]
    assert list(result.objects_of(*actor.types)) == [
        "rover__left__wheels",
        "rover__right__wheels",
    ]


def test_two_versions_with_other_schemas_conflict() -> None:
    other = GO.replace("(idle ?u) :effect", "(ready ?u) :effect")
    found = refused(
        brings("drive", GO, component="a"), brings("drive", other, component="b", version="2.0")
    )
    assert found.code == "PDDL_VERSION"


def test_two_versions_with_one_schema_share_it() -> None:
    result = merged(
        brings("drive", GO, component="a"),
        brings("drive", f"\n\n{GO}", component="b", version="2.0"),
    )
    assert [origin.version for origin in result.action("drive.go").origins] == ["1.0", "2.0"]


def test_component_that_speaks_twice_is_a_mistake() -> None:
    with pytest.raises(ValueError, match="drive on rover"):
        merge([brings("drive", GO), brings("drive", "(:types x)")], HOST)


def test_peers_component_owns_what_it_owns_at_home() -> None:
    described = PluginDescription("a", "1.0", units=(Unit("one", "camera"),))
    ours = Contribution.from_description(described, host="rover", component="a")
    theirs = Contribution.from_description(described, host="mule", component="a@mule")
    found = merge([ours, theirs], "rover")
    assert found.owner("rover__a__one") == ("rover", "a")
    assert found.owner("mule__a__one") == ("mule", "a@mule")


# Facts

SENSE = "(:constants source - target)"


def test_facts_name_own_units_and_self() -> None:
    result = merged(
        brings(
            "gas",
            SENSE,
            "(:init (senses nose source) (bearing-known source self))",
            units={"nose": "sensor"},
        )
    )
    assert list(result.init) == ["bearing-known source rover", "senses rover__gas__nose source"]


def test_fact_waits_for_its_object() -> None:
    waiting = brings("gas", "(:types x)", "(:init (senses nose source))", units={"nose": "sensor"})
    assert list(merged(waiting).parked) == ["senses rover__gas__nose source"]
    together = merged(waiting, brings("other", SENSE))
    assert not together.parked
    assert list(together.init) == ["senses rover__gas__nose source"]


def test_fact_lives_while_one_asserts_it() -> None:
    init = "(:init (bearing-known source self))"
    a, b = brings("a", SENSE, init), brings("b", SENSE, init)
    [origins] = merged(a, b).init.values()
    assert [origin.component for origin in origins] == ["a", "b"]
    assert list(merged(b).init) == list(merged(a, b).init)


def test_words_go_with_the_last_who_uses_them() -> None:
    both = merged(brings("a", "(:types cart)"), brings("b", "(:types cart)"))
    assert "cart" in both.domain.types
    assert "cart" not in merged(brings("c", "(:types van)")).domain.types


# Lookups


def test_owner_of_a_unit_is_found() -> None:
    result = merged(brings("cam", component="left", units={"lens": "camera"}))
    assert result.owner("rover__left__lens") == ("rover", "left")
    with pytest.raises(KeyError):
        result.owner("rover")


def test_local_name_and_types_of_objects_are_kept() -> None:
    result = merged(brings("cam", units={"lens": "camera"}, slots={"frames": "image"}))
    assert result.objects["rover__cam__frames"].local == "frames"
    assert result.objects["rover__cam__frames"].types == ("image",)
    assert list(result.objects_of("unit")) == ["rover__cam__lens"]


@pytest.mark.parametrize("order", [(0, 1), (1, 0)], ids=["untyped first", "typed first"])
def test_who_says_no_type_of_a_value_agrees(order: tuple[int, int]) -> None:
    declared = "(:predicates (seen ?h - host)) (:valued seen{})"
    both = [brings(name, declared.format(t)) for name, t in (("a", ""), ("b", " - pose"))]
    domain = merged(*(both[i] for i in order)).domain
    assert domain.predicates["seen"].valued
    assert domain.predicates["seen"].value_type == "pose"


def test_workers_read_the_types_of_values_as_planning_does() -> None:
    texts = {
        "core": (resources.files("nondum.planning.merge") / "nondum-core.pddl").read_text("utf-8"),
        "odd": "(define (domain d) (:predicates (A ?h) (b ?h) (c ?h)) ; (:valued c - text)\n"
        "(:valued A b\n - Pose c))",
    }
    for name, text in texts.items():
        parsed = parse_fragment(text, name)
        assert isinstance(parsed, DomainFragment)
        planned = {word.name: word.types[0] for word in parsed.valued if word.types}
        assert value_types([Fragment(name, text)]) == planned
        assert planned


def test_core_words_carry_messages() -> None:
    assert core_value_types() == {"bearing-known": "bearing"}
    streams = {t.name for t in core().types if t.types == ("stream",)}
    assert streams <= MESSAGES.keys()
    assert MESSAGES.keys() - streams == {"bearing"}  # which is only said

"""A behaviour that states its effect gets a fragment from the SDK, or a refusal."""

from __future__ import annotations

from types import ModuleType
from typing import Any

import pytest
from tests.kit.golden import Golden

from nondum.planning.merge.contribution import Contribution
from nondum.planning.merge.core import core
from nondum.planning.merge.domain import Merged
from nondum.planning.merge.merge import merge
from nondum.planning.pddl.parse import parse_fragment
from nondum.planning.pddl.syntax import DomainFragment
from nondum.planning.pddl.typegraph import TypeGraph
from nondum.planning.words.phrases import phrasebook
from nondum.sdk import (
    Context,
    Fragment,
    PluginDescription,
    TickedBehaviour,
    Unit,
    WorkerFailed,
    behaviour,
    describe,
    hookimpl,
    load,
)
from nondum.sdk.action_fragment import CORE_PREDICATES, CORE_TYPES, CORE_UNITS
from nondum.sdk.bench import WorkerFactory
from nondum.sdk.errors import Problem


def plugin(*behaviours: Any, unit: str = "lamp", pddl: str = "") -> ModuleType:
    """A plugin with one unit, whose type is given, and a fragment if there is a text for it."""
    made = ModuleType("a_lamp", "Shines.")

    @hookimpl
    def units() -> list[Unit]:
        return [Unit("bulb", unit)]

    @hookimpl
    def fragments() -> list[Fragment]:
        return [Fragment("domain.pddl", f"(define (domain lamp) {pddl})")] if pddl else []

    vars(made).update({"units": units, "fragments": fragments})
    vars(made).update({f"behaviour_{n}": one for n, one in enumerate(behaviours)})
    return made


@behaviour("(blink ?u - lamp)", makes="(greeted ?h)", phrase="greet {h}")
async def blink(ctx: Context, u: str, h: str) -> None:
    """Blink once."""
    ctx.know("greeted", h)


def described(made: ModuleType) -> PluginDescription:
    return describe(load(made, "a-lamp"))


def generated(made: ModuleType) -> DomainFragment:
    """The last fragment of a plugin, as planning reads it."""
    fragment = described(made).fragments[-1]
    assert fragment.name == "generated.pddl"
    parsed = parse_fragment(fragment.text, fragment.name)
    assert isinstance(parsed, DomainFragment)
    return parsed


def merged(made: ModuleType) -> Merged:
    found = merge(
        (Contribution.from_description(described(made), host="rover", component="lamp"),), "rover"
    )
    assert not found.quarantined, found.quarantined
    return found


def wrongs(made: ModuleType) -> tuple[Problem, ...]:
    with pytest.raises(WorkerFailed) as caught:
        described(made)
    return caught.value.problems


def words(problem: Problem) -> str:
    return f"{problem.message} → {problem.fix}"


def test_behaviour_has_the_name_of_its_action_and_the_host_that_its_effect_speaks_of() -> None:
    (found,) = described(plugin(blink)).behaviours
    assert (found.name, found.action) == ("blink", "(blink ?u - lamp ?h - host)")
    assert found.doc == "Blink once."


def test_generated_fragment_is_what_an_author_would_have_written() -> None:
    (fragment,) = described(plugin(blink)).fragments
    assert (
        fragment.text
        == """\
; Made of what @behaviour states.
(define (domain generated)
  (:types lamp - unit)
  (:predicates (greeted ?h - host))
  (:action blink
    :parameters (?u - lamp ?h - host)
    :precondition (and (ready ?u) (on ?u ?h))
    :effect (greeted ?h)))
"""
    )


def test_host_plans_with_it_and_understands_its_phrase() -> None:
    found = merged(plugin(blink))
    assert found.domain.actions["a-lamp.blink"].behaviour == "blink"
    brought = Contribution.from_description(
        described(plugin(blink)), host="rover", component="lamp"
    )
    assert str(phrasebook((brought,), found).goal("greet rover")) == "achieve (greeted rover)"


def test_it_works_on_the_bench(worker: WorkerFactory) -> None:
    bench = worker(plugin(blink))
    bench.behave("blink", u="bulb", h="robot").assert_succeeded()
    bench.wait_fact("greeted", "robot")


def test_method_states_its_effect() -> None:
    class Lamp:
        @behaviour("(shine ?u - light)", makes="(lit ?u)", lasting=True)
        async def shine(self, ctx: Context, u: str) -> None: ...

    found = describe(load(Lamp, "lamp"))
    assert found.behaviours[0].lasting
    assert "(:predicates (lit ?u - light))" in found.fragments[0].text


def test_ticked_behaviour_states_its_effect() -> None:
    @behaviour("(shine ?u - light)", makes="(lit ?u)")
    class Shine(TickedBehaviour):
        def initialise(self, ctx: Context, u: str) -> None: ...

    assert generated(plugin(Shine, unit="light")).actions[0].name == "shine"


def test_name_and_action_are_given_apart() -> None:
    @behaviour("wink", action="(blink ?u - light)", makes="(greeted ?u)")
    async def wink(ctx: Context, u: str) -> None: ...

    made = plugin(wink, unit="light")
    assert described(made).behaviours[0].name == "wink"
    assert merged(made).domain.actions["a-lamp.blink"].behaviour == "wink"


def test_signature_as_name_goes_with_a_fragment_that_its_author_wrote() -> None:
    @behaviour("(blink ?u - light)")
    async def own(ctx: Context, u: str) -> None: ...

    action = "(:action blink :parameters (?u - light) :precondition (ready ?u) :effect (lit ?u))"
    made = plugin(own, unit="light", pddl=f"(:predicates (lit ?u - unit)) {action}")
    assert [fragment.name for fragment in described(made).fragments] == ["domain.pddl"]
    assert merged(made).domain.actions["a-lamp.blink"].behaviour == "blink"


def test_plugin_that_states_no_effect_gets_no_fragment() -> None:
    @behaviour("blink", action="(blink ?u - light)")
    async def old(ctx: Context, u: str) -> None: ...

    assert described(plugin(old)).fragments == ()


def test_precondition_asks_for_what_is_needed_and_for_the_unit_on_the_body() -> None:
    @behaviour(
        "(drive ?u - base ?there - place ?body - host)",
        needs="(and (idle ?u) (not (blocked ?there)))",
        makes="(and (not (idle ?u)) (at ?body ?there))",
        lasting=True,
    )
    async def drive(ctx: Context, u: str, there: str, body: str) -> None: ...

    found = generated(plugin(drive, unit="base"))
    assert str(found.actions[0].precondition) == (
        "(and (ready ?u) (on ?u ?body) (and (idle ?u) (not (blocked ?there))))"
    )
    assert {p.name for p in found.predicates} == {"blocked", "at"}
    assert found.types == ()
    assert merged(plugin(drive, unit="base")).domain.actions["a-lamp.drive"].lasting


def test_only_what_no_fragment_declares_is_declared() -> None:
    @behaviour("(shine ?u - lamp ?c - colour)", makes="(and (lit ?h ?c) (reported person ?h))")
    async def shine(ctx: Context, u: str, c: str, h: str) -> None: ...

    pddl = """(:types lamp - light colour - object) (:constants person - class)
        (:predicates (lit ?h - host ?c - colour)) ; words (of mine"""
    made = plugin(shine, pddl=pddl + "\n")
    found = generated(made)
    assert (found.types, found.predicates) == ((), ())
    assert merged(made).domain.actions


def test_one_predicate_of_several_actions_takes_what_any_of_them_says() -> None:
    @behaviour("(shine ?u - lamp)", makes="(lit ?u)")
    async def shine(ctx: Context, u: str) -> None: ...

    @behaviour("(light-up ?u - lamp ?p - place)", makes="(and (lit ?p) (seen ?p ?p))")
    async def light_up(ctx: Context, u: str, p: str) -> None: ...

    text = described(plugin(shine, light_up)).fragments[0].text
    assert "(lit ?p - (either place lamp))" in text
    assert len(merged(plugin(shine, light_up)).domain.actions) == 2


def test_quantified_variables_are_known() -> None:
    makes = "(forall (?c - camera ?h - host) (when (on ?c ?h) (dazzled ?c)))"

    @behaviour("(flash ?u - light)", needs="(exists (?p - place) (= ?p ?p))", makes=makes)
    async def flash(ctx: Context, u: str) -> None: ...

    found = generated(plugin(flash, unit="light"))
    assert [str(p) for p in found.predicates[0].parameters] == ["?c - camera"]
    assert merged(plugin(flash, unit="light")).domain.actions


@pytest.mark.parametrize(
    ("makes", "needs", "situation"),
    [
        ("", "(idle ?u)", "it needs, and makes nothing"),
        ("", "", "it makes nothing"),
        ("lit", "", "a word"),
        ("()", "", "an empty formula"),
        ("(lit ?u) (seen ?u)", "", "two formulas"),
        ("(lit ?u", "", "a bracket is not closed"),
        ("(lit ?u))", "", "a bracket too many"),
        ("(" * 70 + ")" * 70, "", "seventy brackets"),
        ("(lit ?x)", "", "an unknown parameter is made"),
        ("(lit ?u)", "(= ?u ?x)", "an unknown parameter is needed"),
        ("(lit self)", "", "self"),
        ("(lit ?u - light)", "", "a type in an effect"),
        ("(increase (total-cost) 3)", "", "a cost"),
        ("(and lit)", "", "a word in a conjunction"),
        ("(?u lit)", "", "a parameter for a predicate"),
        ("(forall (?c) (lit ?c))", "", "a variable without a type"),
        ("(forall (?c - colour) (lit ?c))", "", "an unknown type"),
        ("(on ?u)", "", "too few arguments for the core"),
        ("(and (lit ?u) (lit ?u ?u))", "", "one and two arguments"),
        ("(lit ?u)", "(idle ?u", "a bracket of a need is not closed"),
    ],
)
def test_mistake_is_told_with_the_authors_line(
    makes: str, needs: str, situation: str, golden: Golden
) -> None:
    @behaviour("(blink ?u - light)", makes=makes, needs=needs)
    async def wrong(ctx: Context, u: str) -> None: ...

    (problem,) = wrongs(plugin(wrong, unit="light"))
    assert problem.code == "ACTION_EFFECT"
    place = f"test_action_fragment.py:{wrong.__code__.co_firstlineno} behaviour 'blink'"
    assert problem.where.endswith(place)
    golden.check(situation, words(problem))


@pytest.mark.parametrize(
    ("signature", "situation"),
    [
        ("(blink ?u - host)", "an action of no unit"),
        ("(blink ?u - light ?c - colour)", "a parameter of an unknown type"),
        ("(shine ?u - light)", "an action that a fragment declares"),
    ],
)
def test_action_that_cannot_be_declared_is_told(
    signature: str, situation: str, golden: Golden
) -> None:
    names = ["ctx", *(part[0] for part in signature.split("?")[1:])]
    wrong: dict[str, Any] = {}
    exec(f"async def wrong({', '.join(names)}): ...", wrong)
    marked = behaviour(signature, makes="(lit ?u)")(wrong["wrong"])
    pddl = "(:action shine :parameters (?u - light) :effect (and))"
    (problem,) = wrongs(plugin(marked, pddl=pddl))
    assert problem.code == "ACTION_EFFECT"
    golden.check(situation, words(problem))


def test_all_mistakes_are_told_at_once(golden: Golden) -> None:
    @behaviour("(one ?u - light)", makes="(lit ?x)")
    async def one(ctx: Context, u: str) -> None: ...

    @behaviour("(two ?u - light)", makes="(lit ?h)")
    async def two(ctx: Context, u: str) -> None: ...

    @behaviour("(three u - light)", makes="(lit ?u)")
    async def three(ctx: Context, u: str) -> None: ...

    @behaviour("(four ?u - light)", action="(five ?u - light)")
    async def four(ctx: Context, u: str) -> None: ...

    @behaviour("six")
    async def six(ctx: Context, u: str) -> None: ...

    found = wrongs(plugin(one, two, three, four, six, unit="light"))
    golden.check("five mistakes at once", "\n".join(words(problem) for problem in found))


def test_fragment_that_cannot_be_read_is_left_to_the_merge() -> None:
    found = described(plugin(blink, pddl="(:predicates (lit ?u"))
    assert [fragment.name for fragment in found.fragments] == ["domain.pddl", "generated.pddl"]


def test_words_of_the_core_are_known() -> None:
    assert {"object", *(declared.name for declared in core().types)} == CORE_TYPES
    graph = TypeGraph({declared.name: frozenset(declared.types) for declared in core().types})
    assert {name for name in CORE_TYPES if "unit" in graph.ancestors(name)} == CORE_UNITS
    assert {p.name: len(p.parameters) for p in core().predicates} == CORE_PREDICATES

"""Merging is a pure function of the set of contributions, whatever they say."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
from tests.planning.fragments import HOST, brings
from tests.planning.strangers import STRANGERS, component

from nondum.planning.merge.contribution import Contribution
from nondum.planning.merge.merge import merge

TYPES = st.sampled_from(["cart", "cart - base", "cart - unit", "van - cart", "van - base"])
PREDICATES = st.sampled_from(
    ["(near ?p - place)", "(near ?p - object)", "(near ?p ?q)", "(near ?u - unit)", "(far ?p)"]
)
OBJECTS = st.sampled_from(["door - place", "door", "door - class", "gate - place"])
INITS = st.sampled_from(["(near door)", "(near gate)", "(found door self)", "(far gate)"])
ACTIONS = st.sampled_from(
    [
        "(:action go :parameters (?u - base) :precondition (ready ?u))",
        "(:action go :parameters (?u - unit) :precondition (ready ?u) :effect (far ?u))",
        "(:action stop :parameters (?u - base) :effect (not (idle ?u)))",
        "(:action hop :parameters (?u - base) :precondition (or (ready ?u) (idle ?u))"
        " :effect (when (forall (?h - host) (on ?u ?h)) (far ?u)))",
    ]
)
RULES = st.sampled_from(
    [
        "",
        "(:derived (far ?p - object) (ready ?p))",
        "(:derived (near ?p - place) (not (far ?p)))",
        "(:derived (far ?p - object) (not (near ?p)))",
    ]
)


@st.composite
def contributions(draw: st.DrawFn) -> list[Contribution]:
    """Components that agree and disagree about a few words."""
    made = []
    for name in draw(st.lists(st.sampled_from("abcdef"), unique=True, max_size=5)):
        body = " ".join(
            f"({section} {' '.join(draw(st.lists(words, max_size=2, unique=True)))})"
            for section, words in (
                (":types", TYPES),
                (":predicates", PREDICATES),
                (":constants", OBJECTS),
            )
        )
        made.append(
            brings(
                draw(st.sampled_from([name, "shared"])),
                f"{body} {draw(RULES)} {draw(ACTIONS)}",
                f"(:init {' '.join(draw(st.lists(INITS, max_size=2)))})",
                rank=draw(st.integers(0, 2)),
                component=name,
                units={"wheels": "base"},
            )
        )
    return made


@given(st.data(), contributions())
def test_order_does_not_matter(data: st.DataObject, given: list[Contribution]) -> None:
    shuffled = data.draw(st.permutations(given))
    first, second = merge(given, HOST), merge(shuffled, HOST)
    assert first == second
    assert str(first) == str(second)


@given(contributions())
def test_saying_it_twice_changes_nothing(given: list[Contribution]) -> None:
    assert merge([*given, *given], HOST) == merge(given, HOST)


@given(contributions())
def test_what_is_kept_out_changes_nothing(given: list[Contribution]) -> None:
    whole = merge(given, HOST)
    admitted = [c for c in given if c.component not in whole.quarantined]
    without = merge(admitted, HOST)
    assert not without.quarantined
    assert (without.domain, without.objects, without.init, without.parked) == (
        whole.domain,
        whole.objects,
        whole.init,
        whole.parked,
    )


@given(contributions())
def test_retraction_is_exact(given: list[Contribution]) -> None:
    before = merge(given, HOST)
    newcomer = brings("zebra", "(:types stripe)", rank=9, units={"tail": "sensor"})
    during = merge([*given, newcomer], HOST)
    assert "zebra" not in during.quarantined
    assert "rover__zebra__tail" in during.objects
    assert merge(given, HOST) == before


@given(contributions())
def test_unrelated_component_keeps_its_meaning(given: list[Contribution]) -> None:
    """A component that shares only the core's words is the same with any other components."""
    strangers = [component(plugin, HOST, rank=9) for plugin in STRANGERS]
    alone, together = merge(strangers, HOST), merge([*strangers, *given], HOST)
    for name, action in alone.domain.actions.items():
        assert together.domain.actions[name] == action
        actors = action.parameters[0].types
        assert list(together.objects_of(*actors)) == list(alone.objects_of(*actors))
    assert set(alone.init) <= set(together.init)

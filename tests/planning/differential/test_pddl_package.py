"""The `pddl` package and nondum read the same domains in texts that both accept."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from typing import Any

import pytest
from hypothesis import given
from pddl.parser.domain import DomainParser
from tests.kit.examples import a_share
from tests.planning.differential.generated import texts
from tests.planning.differential.texts import TEXTS, Text

from nondum.planning.ground.pddl_text import pddl_text
from nondum.planning.pddl.parse import parse_fragment
from nondum.planning.pddl.syntax import DomainFragment
from nondum.planning.pddl.wording import without_dots
from nondum.sdk.errors import FragmentRefused
from nondum_pddl_workbench.standalone import load_domain

NOT_READ_BY_THE_OTHER = {"costs"}
"""It knows no functions."""


@pytest.fixture(autouse=True, scope="module")
def _tracebacks_are_whole_again() -> Iterator[None]:
    """The package shortens all tracebacks of the process for good."""
    yield
    vars(sys).pop("tracebacklimit", None)


def without_root(text: str) -> str:
    """The package knows no type `object`: where there is no other, none is written."""
    return text if "(:types" in text else text.replace(" - object", "").replace(" :typing", "")


def is_readable(text: Text, domain: str) -> bool:
    """Whether the package can read it at all."""
    without_types = re.sub(r"\(:types[^)]*\)", "", domain)
    return text.name not in NOT_READ_BY_THE_OTHER and " - object" not in without_types


def by_the_other(text: str) -> Any | None:
    """The domain as the package reads it; None if it refuses."""
    try:
        return DomainParser()(text)
    except Exception:  # it raises whatever lark and its own checks do
        return None


def same(mine: DomainFragment, other: Any) -> None:
    """Both say the same of types, predicates, constants and actions."""
    assert {p.name: len(p.parameters) for p in mine.predicates} == {
        str(p.name): len(p.terms) for p in other.predicates
    }
    assert {a.name: [p.name[1:] for p in a.parameters] for a in mine.actions} == {
        str(a.name): [str(p.name) for p in a.parameters] for a in other.actions
    }
    assert {
        (a.name, p.name[1:], frozenset(p.types) - {"object"})
        for a in mine.actions
        for p in a.parameters
    } == {
        (str(a.name), str(p.name), frozenset(map(str, p.type_tags)) - {"object"})
        for a in other.actions
        for p in a.parameters
    }
    assert {c.name for c in mine.constants} == {str(c.name) for c in other.constants}
    assert {t.name for t in mine.types} - {"object"} == set(map(str, other.types)) - {"object"}


def as_written(text: Text) -> str:
    loaded = text.load()
    return pddl_text(loaded.merged, loaded.facts, loaded.goal, spelled=without_dots).domain


@pytest.mark.parametrize("text", TEXTS, ids=str)
def test_what_nondum_writes_is_read_the_same(text: Text) -> None:
    domain = without_root(as_written(text))
    mine, other = parse_fragment(domain, "d"), by_the_other(domain)
    assert isinstance(mine, DomainFragment)
    assert (other is not None) == is_readable(text, domain)
    if other is not None:
        same(mine, other)


@given(text=texts(plain=True))
@a_share(4)
def test_what_both_accept_is_the_same(text: Text) -> None:
    for domain in (without_root(as_written(text)), text.domain):
        other = by_the_other(domain)
        if other is not None:
            same(load_domain(domain, "d"), other)


@pytest.mark.parametrize(
    "domain",
    [
        "(define (domain d) (:predicates (p ?x)) (:action a :parameters (?x) :effect (q ?x)))",
        "(define (domain d) (:predicates (p ?x)) (:action a :parameters (?x) :effect (p ?y)))",
        "(define (domain d) (:predicates (p ?x)) (:action a :parameters (?x ?x) :effect (p ?x)))",
        "(define (domain d) (:predicates (p ?x))",
        "(define (domain d) (:predicate (p ?x)))",
    ],
    ids=["predicate", "variable", "twice", "cut off", "section"],
)
def test_what_is_wrong_is_refused_by_every_reader(domain: str) -> None:
    with pytest.raises(FragmentRefused):
        load_domain(domain, "d")

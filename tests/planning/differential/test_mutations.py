"""Whatever becomes of a text, it is read, or refused with a place: nothing else ever happens."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn
from tests.kit.examples import a_share
from tests.planning.differential.generated import texts
from tests.planning.differential.texts import TEXTS, Text

from nondum.planning.ground.ground import ground
from nondum.planning.pddl.parse import parse_formula, parse_signature
from nondum.sdk.errors import FragmentRefused
from nondum_pddl_workbench.standalone import load, load_domain

PIECES = re.compile(r"[^\s()]+|[()]|\s+")
STRANGE = [
    *("(", ")", "()", "-", "?", "?x", "=", ":", ";", "'", '"', "\x00", "\t", "ß", "١", "\u2028"),
    *("not", "and", "or", "forall", "when", "either", "exists", "imply", "increase", "total-cost"),
    *("(:action a)", "(:types a - b b - a)", "(:derived (p) (not (p)))", "(:durative-action x)"),
    *("object", "define", "-1", "1.5", "1e9", ":parameters", ":goal", "?x - (either a b)"),
]
LIMIT = 2_000
"""Bindings: a mutation may well ask for more than is worth waiting for."""


@st.composite
def mutated(draw: DrawFn, text: str) -> str:
    """The text with a few pieces taken out, doubled, moved, or put in from elsewhere."""
    pieces = PIECES.findall(text)
    for _ in range(draw(st.integers(1, 4))):
        at = draw(st.integers(0, max(0, len(pieces) - 1)))
        other = draw(st.integers(0, max(0, len(pieces) - 1)))
        match draw(st.sampled_from(["out", "double", "swap", "strange", "cut", "any"])):
            case "out":
                del pieces[at : at + 1]
            case "double":
                pieces[at:at] = pieces[at:other] if at < other < at + 20 else pieces[at : at + 1]
            case "swap" if pieces:
                pieces[at], pieces[other] = pieces[other], pieces[at]
            case "strange":
                pieces.insert(at, f" {draw(st.sampled_from(STRANGE))} ")
            case "cut":
                del pieces[at:]
            case _:
                pieces.insert(at, draw(st.text(max_size=5)))
    return "".join(pieces)


def read(domain: str, problem: str) -> None:
    """Read and ground; a refusal names a place in one of the texts."""
    try:
        found = load(domain, "domain.pddl", problem, "problem.pddl")
        ground(found.merged, found.facts, found.goal, limit=LIMIT)
    except FragmentRefused as refused:
        assert refused.problems
        for one in refused.problems:
            assert one.code
            assert one.message
            if one.code != "PDDL_TOO_MANY":
                assert re.search(r"(domain|problem)\.pddl(:[1-9][0-9]*:[1-9][0-9]*)?$", one.where)


@pytest.mark.parametrize("text", TEXTS, ids=str)
@given(data=st.data())
@a_share(3)
def test_a_mutated_domain(text: Text, data: st.DataObject) -> None:
    read(data.draw(mutated(text.domain)), text.problem)


@pytest.mark.parametrize("text", TEXTS, ids=str)
@given(data=st.data())
@a_share(3)
def test_a_mutated_problem(text: Text, data: st.DataObject) -> None:
    read(text.domain, data.draw(mutated(text.problem)))


@given(text=texts(), data=st.data())
def test_mutations_of_whatever_is_written(text: Text, data: st.DataObject) -> None:
    read(data.draw(mutated(text.domain)), data.draw(mutated(text.problem)))


@given(text=st.text(max_size=60) | st.text(alphabet="()?:- ;abe=\n", max_size=60))
def test_any_text_at_all(text: str) -> None:
    for parse in (load_domain, parse_formula, parse_signature):
        try:
            parse(text, "domain.pddl")
        except FragmentRefused as refused:
            assert refused.problems[0].where.startswith("domain.pddl")

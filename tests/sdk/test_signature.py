"""Signatures of actions are read as they stand, or refused in words."""

from __future__ import annotations

import contextlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum.sdk import WorkerFailed
from nondum.sdk.signature import Parameter, parse_signature


def test_parameters_keep_order_and_type() -> None:
    signature = parse_signature("( track ?u - tracker ?from ?to - (either place target) )")
    assert signature.name == "track"
    assert signature.actor == Parameter("u", ("tracker",))
    assert signature.parameters[1:] == (
        Parameter("from", ("place", "target")),
        Parameter("to", ("place", "target")),
    )
    assert [p.identifier for p in signature.parameters] == ["u", "from_", "to"]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "not of the form"),
        ("point ?u - pointer", "not of the form"),
        ("()", "not of the form"),
        ("point ?u - pointer)", "not of the form"),
        ("(point ?u - pointer", "not of the form"),
        ("(point)", "no parameter"),
        ("(Point ?u - pointer)", "'Point' is no name"),
        ("(point u - pointer)", "expected a ?parameter, found 'u'"),
        ("(point ?u)", "?u has no type"),
        ("(point ?u -)", "?u has no type"),
        ("(point ?u pointer)", "?u has no type"),
        ("(point ?u pointer ?h)", "?u has no type"),
        ("(point ?u - pointer ?u - host)", "?u stands there twice"),
        ("(point ?u - (or a b))", "(either a b …)"),
        ("(point ?u - (either))", "(either a b …)"),
        ("(point ?u - (either a)", "(either a b …)"),
        ("(point ?u - ?h)", "'?h' is no type"),
        ("(point ?U - pointer)", "?U is no name"),
    ],
)
def test_malformed_signatures_are_explained(text: str, told: str) -> None:
    with pytest.raises(WorkerFailed) as caught:
        parse_signature(text)
    assert caught.value.code == "ACTION_SIGNATURE"
    assert told in str(caught.value)


@given(st.text(alphabet="()?- ahu\n", max_size=40))
def test_any_text_is_read_or_refused(text: str) -> None:
    with contextlib.suppress(WorkerFailed):
        assert parse_signature(text).parameters

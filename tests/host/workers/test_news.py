"""A stranger's events become the host's values, or end the stranger."""

from __future__ import annotations

import re
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum.host.core.events.facts import FactForgotten, FactKnown, StreamFlowing
from nondum.host.core.events.workers import WorkerFaulted, WorkerLogged
from nondum.host.workers.news import (
    MAX_CLAIMED_BYTES,
    MAX_CLAIMS,
    MAX_TEXT,
    Claims,
    parse_answer,
    parse_news,
    parse_progress,
    parse_rates,
)
from nondum.sdk.errors import MessageInvalid, ProtocolViolation

PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner),
    max_leaves=8,
)
OTHERS = ("stream", "flowing", "level", "message")
KEYS = st.sampled_from(
    ["problem", "predicate", "arguments", "value", "stream", "flowing", "level", "message"]
)
NAMES = st.sampled_from(["know", "forget", "flow", "log", "fault", "boast"])


@given(NAMES, st.dictionaries(KEYS, PLAIN))
def test_anything_is_parsed_or_a_violation(name: str, body: dict[str, Any]) -> None:
    try:
        news = parse_news("guest", {"s"}, name, body)
    except (ProtocolViolation, MessageInvalid):
        return
    assert news.component == "guest"


@given(st.dictionaries(st.sampled_from(["fraction", "text"]), PLAIN))
def test_progress_is_between_nothing_and_all(body: dict[str, Any]) -> None:
    try:
        fraction, _ = parse_progress(body)
    except ProtocolViolation:
        return
    assert 0.0 <= fraction <= 1.0


def test_rates_are_those_of_its_own_streams_that_can_be() -> None:
    told = {"s": 9.5, "other": 1, "t": float("nan"), "u": -1, "v": True, "w": 10**400, "x": "1"}
    own = {"s", "t", "u", "v", "w", "x"}
    assert parse_rates(own, {"rates": told}) == {"s": 9.5}
    assert parse_rates(own, {"rates": [["s", 1]]}) == parse_rates(own, {}) == {}


def test_each_kind_is_read() -> None:
    fact = {"predicate": "p", "arguments": ["a"]}
    assert parse_news("g", (), "know", fact) == FactKnown("g", "p", ("a",))
    assert parse_news("g", (), "forget", fact) == FactForgotten("g", "p", ("a",))
    assert parse_news("g", {"s"}, "flow", {"stream": "s", "flowing": True}) == StreamFlowing(
        "g", "s", True
    )
    log = parse_news("g", (), "log", {"level": "info", "message": "a\x1b\nb"})
    assert log == WorkerLogged("g", "info", "a\\x1b\nb")


FACT = {"predicate": "p", "arguments": ["a"]}
FLOW = {"stream": "s", "flowing": True}


@pytest.mark.parametrize(
    ("name", "body", "code"),
    [
        pytest.param("boast", {}, "EVENT_UNKNOWN", id="no such event"),
        pytest.param("know", {"predicate": "p"}, "EVENT_INVALID", id="no arguments"),
        pytest.param("know", {**FACT, "predicate": 1}, "EVENT_INVALID", id="a number as name"),
        pytest.param("know", {**FACT, "arguments": [1]}, "EVENT_INVALID", id="no words"),
        pytest.param("forget", {**FACT, "predicate": ""}, "EVENT_INVALID", id="empty"),
        pytest.param("forget", {**FACT, "arguments": ["a" * 257]}, "EVENT_INVALID", id="long"),
        pytest.param("know", {**FACT, "arguments": ["a\n"]}, "EVENT_INVALID", id="unprintable"),
        pytest.param("flow", {**FLOW, "stream": "other"}, "RESULT_INVALID", id="other's stream"),
        pytest.param("flow", {**FLOW, "flowing": 1}, "EVENT_INVALID", id="almost true"),
        pytest.param("log", {"level": "info"}, "EVENT_INVALID", id="no message"),
        pytest.param("fault", {"problem": "x"}, "EVENT_INVALID", id="no problem"),
        pytest.param("fault", {"problem": {"code": "a b"}}, "EVENT_INVALID", id="no code"),
    ],
)
def test_what_is_no_news_is_refused(name: str, body: dict[str, Any], code: str) -> None:
    with pytest.raises(ProtocolViolation) as violation:
        parse_news("guest", {"s"}, name, body)
    assert violation.value.code == code


WRONG = ["pose", {"header": {}, "position": [1.0, 2.0]}]


@pytest.mark.parametrize(
    ("value", "types", "code"),
    [
        ({"a": 1}, {}, "MESSAGE_FIELD"),
        (WRONG, {}, "MESSAGE_FIELD"),
        (["no such type", {}], {}, "MESSAGE_TYPE"),
        (["scalar", {"header": {}, "value": 1.0, "unit": "V"}], {"p": "pose"}, "MESSAGE_TYPE"),
    ],
)
def test_wrong_value_of_a_fact_names_the_predicate(
    value: Any, types: dict[str, str], code: str
) -> None:
    with pytest.raises(MessageInvalid) as wrong:
        parse_news("guest", (), "know", {**FACT, "value": value}, types)
    assert wrong.value.code == code
    assert re.search(r"\bp\b", wrong.value.problems[0].message)


def test_value_of_the_declared_type_is_taken() -> None:
    value = ["scalar", {"header": {}, "value": 1.0, "unit": "V"}]
    news = parse_news("guest", (), "know", {**FACT, "value": value}, {"p": "scalar"})
    assert isinstance(news, FactKnown)
    assert news.value == value


def test_mistake_that_a_worker_tells_of_is_bounded_and_under_its_name() -> None:
    said = {"code": "MESSAGE_FIELD", "message": "a\x1b" + "b" * 9999, "where": "plugin.py:3"}
    news = parse_news("guest", (), "fault", {"problem": said})
    assert isinstance(news, WorkerFaulted)
    (problem,) = news.problems
    assert problem.code == "MESSAGE_FIELD"
    assert problem.where == "guest (plugin.py:3)"
    assert len(problem.message) < 600
    assert "\x1b" not in problem.message


@pytest.mark.parametrize("body", [{}, {"fraction": 1}, {"fraction": "1", "text": ""}])
def test_what_is_no_progress_is_refused(body: dict[str, Any]) -> None:
    with pytest.raises(ProtocolViolation) as violation:
        parse_progress(body)
    assert violation.value.code == "EVENT_INVALID"


def test_claims_follow_the_news() -> None:
    claims = Claims()
    claims.take(FactKnown("g", "p", ("a",)))
    claims.take(FactKnown("g", "p", ("b",)))
    claims.take(StreamFlowing("g", "s", True))
    claims.take(FactForgotten("g", "p", ("a",)))
    assert list(claims) == [FactKnown("g", "p", ("b",)), StreamFlowing("g", "s", True)]
    claims.take(StreamFlowing("g", "s", False))
    assert list(claims) == [FactKnown("g", "p", ("b",))]


def test_claims_are_bounded() -> None:
    claims = Claims()
    with pytest.raises(ProtocolViolation, match=str(MAX_CLAIMS)):
        for number in range(MAX_CLAIMS + 1):
            claims.take(FactKnown("g", "p", (str(number),)))


def test_what_claims_take_is_bounded() -> None:
    claims = Claims()
    with pytest.raises(ProtocolViolation, match=f"EVENT_INVALID .*{MAX_CLAIMED_BYTES}"):
        for number in range(MAX_CLAIMS):
            claims.take(FactKnown("g", "p", (str(number),), "x" * 10_000))


def test_answer_is_a_printable_text_of_bounded_length() -> None:
    assert parse_answer({}) == ""
    assert parse_answer({"answer": "at home\x1b[2J"}) == "at home\\x1b[2J"
    assert len(parse_answer({"answer": "x" * (2 * MAX_TEXT)})) <= MAX_TEXT


@pytest.mark.parametrize("answer", [None, 7, b"at home", ["at home"]])
def test_what_is_no_text_is_no_answer(answer: object) -> None:
    with pytest.raises(ProtocolViolation):
        parse_answer({"answer": answer})

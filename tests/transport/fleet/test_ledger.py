"""A host's catalogue as it is told: revisions, limits, and how long removals are remembered."""

from __future__ import annotations

import string
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum.sdk.errors import ProtocolViolation
from nondum.transport.fleet import EntryRefused
from nondum.transport.fleet.chunk import MAX_CATALOGUE, MAX_ENTRY, MAX_KEY, MAX_PARTS, Chunk, parse
from nondum.transport.fleet.ledger import Ledger
from nondum.transport.peers.messages import Notice, decode, encode
from nondum.transport.peers.pulse import State

ON = {"holds": True}
names = st.text(string.ascii_letters, min_size=1, max_size=3)
changes = st.dictionaries(names, st.none() | st.just(ON) | st.just({"holds": False}))


def published(*steps: dict[str, Any], remembered: int = 100) -> Ledger:
    ledger = Ledger(7, remembered)
    for step in steps:
        ledger.publish(step)
    return ledger


@given(st.lists(changes, max_size=5), changes)
def test_same_entries_have_the_same_digest(
    steps: list[dict[str, Any]], last: dict[str, Any]
) -> None:
    """Not of how they came to be."""
    ledger = published(*steps, last)
    final: dict[str, Any] = {}
    for step in [*steps, last]:
        final.update(step)
    assert ledger.state.digest == published(final).state.digest
    alone = published(*({key: entry} for key, entry in sorted(final.items())))
    assert ledger.state.digest == alone.state.digest


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ({"a": ON}, {"b": ON}),
        ({"a": ON}, {"a": {"holds": False}}),
        ({"a": ON}, {"a": ON, "b": ON}),
        ({"a": {"n": 1}, "b": {"n": 2}}, {"a": {"n": 2}, "b": {"n": 1}}),
    ],
    ids=["key", "value", "one more", "exchanged"],
)
def test_other_entries_have_another_digest(one: dict[str, Any], other: dict[str, Any]) -> None:
    assert published(one).state.digest != published(other).state.digest


def test_what_changes_nothing_is_no_revision() -> None:
    ledger = published({"a": ON})
    before = ledger.state
    assert not ledger.publish({"a": ON, "b": None})
    assert ledger.state == before


def test_delta_tells_only_what_is_newer() -> None:
    ledger = published({"a": ON, "b": ON}, {"b": None}, {"c": ON})
    (delta,) = ledger.delta(2) or ()
    assert (delta.since, delta.state, set(delta.changes)) == (2, ledger.state, {"b", "c"})
    assert delta.changes["b"] is None


@pytest.mark.parametrize("since", [0, -1, 5, 10**9])
def test_delta_from_nowhere_is_none(since: int) -> None:
    assert published({"a": ON}, {"b": ON}).delta(since) is None


def test_forgotten_removals_are_told_by_the_whole() -> None:
    ledger = published({"a": ON, "b": ON, "c": ON}, {"a": None}, {"b": None}, remembered=1)
    assert ledger.delta(2) is None
    (delta,) = ledger.delta(3) or ()
    assert delta.changes == {"b": None}
    (whole,) = ledger.read(7, 2)
    assert (whole.since, set(whole.changes)) == (0, {"c"})


def test_removals_are_remembered_only_so_far() -> None:
    ledger = published(remembered=10)
    for number in range(1000):
        ledger.publish({f"fact/{number}": ON})
        ledger.publish({f"fact/{number}": None})
    assert ledger.remembered == 10


@pytest.mark.parametrize("epoch", [6, 0, -1])
def test_other_epoch_reads_the_whole(epoch: int) -> None:
    (whole,) = published({"a": ON}).read(epoch, 2)
    assert whole.since == 0


def test_refused_publish_changes_nothing() -> None:
    ledger = published({"a": ON})
    before = ledger.whole()
    with pytest.raises(EntryRefused) as long:
        ledger.publish({"b": ON, "c": {"text": "x" * MAX_ENTRY}})
    assert (long.value.code, long.value.problems[0].where) == ("ENTRY_TOO_LONG", "c")
    with pytest.raises(TypeError):
        ledger.publish({"b": ON, "c": {"a": object()}})
    with pytest.raises(ProtocolViolation):
        ledger.publish({"b": ON, "c": {"a": "\ud800"}})
    for key in ["", "k" * (MAX_KEY + 1), "\ud800"]:
        with pytest.raises(EntryRefused, match="ENTRY_KEY"):
            ledger.publish({"b": ON, key: ON})
    assert ledger.whole() == before


def test_catalogue_has_a_limit_that_removals_give_back() -> None:
    ledger = published()
    big = {"text": "x" * (MAX_ENTRY - 100)}
    fits = MAX_CATALOGUE // MAX_ENTRY
    for number in range(fits):
        ledger.publish({f"fact/{number}": big})
    with pytest.raises(EntryRefused, match="CATALOGUE_TOO_LONG"):
        ledger.publish({"one": big, "more": big})
    assert ledger.publish({"fact/0": None, "more": big})
    with pytest.raises(EntryRefused, match="CATALOGUE_TOO_LONG"):
        ledger.publish({"fact/0": big, "fact/1": big, "one": big, "too": big})


@pytest.mark.parametrize(
    "entries",
    [
        {f"f{number}": ON for number in range(50_000)},
        {f"{number:0250}": {} for number in range(12_000)},
        {f"f{number}": {"text": "x" * 64_000} for number in range(60)},
        {"f": {"text": "x" * (MAX_ENTRY - 11)}},
    ],
    ids=["many short", "long keys", "half a message each", "the longest"],
)
def test_every_chunk_fits_a_message(entries: dict[str, Any]) -> None:
    whole = published(entries).whole()
    assert len(whole) <= MAX_PARTS
    told: dict[str, Any] = {}
    for chunk in whole:
        message = decode(encode(Notice("fleet.changed", chunk.to_body())))
        assert isinstance(message, Notice)
        assert parse(message.args) == chunk
        told.update(chunk.changes)
    assert told.keys() == entries.keys()


GOOD = Chunk(7, 1, State(2, b"12345678"), 0, 1, {"a": b"\x80", "b": None})


@pytest.mark.parametrize(
    "wrong",
    [
        {"epoch": 0},
        {"epoch": "7"},
        {"since": -1},
        {"since": 3},
        {"since": True},
        {"since": None},
        {"revision": 0},
        {"revision": 2**60},
        {"digest": b"short"},
        {"digest": "12345678"},
        {"part": 1},
        {"part": -1},
        {"parts": 0},
        {"parts": MAX_PARTS + 1},
        {"changes": []},
        {"changes": {"a": "text"}},
        {"changes": {"k" * (MAX_KEY + 1): None}},
        {"more": 1},
    ],
    ids=str,
)
def test_odd_chunk_is_a_violation(wrong: dict[str, Any]) -> None:
    assert parse(GOOD.to_body()) == GOOD
    with pytest.raises(ProtocolViolation):
        parse({**GOOD.to_body(), **wrong})


@pytest.mark.parametrize("missing", sorted(GOOD.to_body()))
def test_chunk_with_a_field_missing_is_a_violation(missing: str) -> None:
    with pytest.raises(ProtocolViolation):
        parse({key: field for key, field in GOOD.to_body().items() if key != missing})


bodies = st.dictionaries(
    st.sampled_from(sorted(GOOD.to_body())) | names,
    st.none() | st.integers() | st.binary(max_size=9) | st.dictionaries(names, st.binary()),
)


@given(bodies)
def test_any_body_is_a_chunk_or_a_violation(body: dict[str, Any]) -> None:
    try:
        chunk = parse({**GOOD.to_body(), **body})
    except ProtocolViolation:
        return
    assert chunk.part < chunk.parts

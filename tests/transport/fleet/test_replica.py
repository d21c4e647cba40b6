"""A replica becomes its ledger, whatever the way between them does to what is told."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    invariant,
    precondition,
    rule,
)

from nondum.sdk.errors import ProtocolViolation
from nondum.sdk.wire import pack
from nondum.transport.fleet import chunk as chunks
from nondum.transport.fleet import replica as replicas
from nondum.transport.fleet.chunk import Chunk
from nondum.transport.fleet.ledger import Ledger
from nondum.transport.fleet.replica import Change, Replica
from nondum.transport.peers.pulse import DIGEST_BYTES, State

REMEMBERED = 3
keys = st.sampled_from([f"fact/{number}" for number in range(8)])
# Long ones take several chunks.
entries = st.none() | st.builds(
    lambda number, length: {"number": number, "text": "x" * length},
    st.integers(0, 3),
    st.sampled_from([0, 50_000]),
)


class Told(RuleBasedStateMachine):
    """A ledger, what is on its way from it, and a replica that must not believe in the way."""

    def __init__(self) -> None:
        super().__init__()
        self.epoch = 1
        self.ledger = Ledger(self.epoch, REMEMBERED)
        self.model: dict[str, Any] = {}
        self.history: dict[tuple[int, int], dict[str, Any]] = {(1, 1): {}}
        self.on_the_way: list[Chunk] = []
        self.pings: list[tuple[int, State]] = []
        self.replica = Replica(self.epoch)
        self.seen: dict[str, Any] = {}

    @rule(changes=st.dictionaries(keys, entries, max_size=4), is_told=st.booleans())
    def something_is_published(self, changes: dict[str, Any], is_told: bool) -> None:
        before = self.ledger.state.revision
        self.ledger.publish(changes)
        for key, entry in changes.items():
            self.model.pop(key, None)
            if entry is not None:
                self.model[key] = entry
        self.history[self.epoch, self.ledger.state.revision] = dict(self.model)
        if is_told:
            self.on_the_way.extend(self.ledger.delta(before) or ())

    @rule()
    def the_host_restarts(self) -> None:
        """Peers learn of it before a message of the new run; older ones are still on their way."""
        self.epoch += 1
        self.ledger = Ledger(self.epoch, REMEMBERED)
        self.model = {}
        self.history[self.epoch, 1] = {}
        self.replica, self.seen = Replica(self.epoch), {}

    @rule()
    def a_ping_is_sent(self) -> None:
        self.pings.append((self.epoch, self.ledger.state))

    @precondition(lambda self: self.pings)
    @rule(data=st.data())
    def a_ping_comes(self, data: st.DataObject) -> None:
        index = data.draw(st.integers(0, len(self.pings) - 1))
        epoch, state = self.pings.pop(index)
        if epoch == self.epoch:  # links end with the life of their host
            self.replica.hear(state)

    @rule()
    def it_is_asked(self) -> None:
        self.on_the_way.extend(self.ledger.read(self.replica.epoch, self.replica.since))

    @precondition(lambda self: self.on_the_way)
    @rule(data=st.data(), again=st.booleans())
    def a_chunk_comes(self, data: st.DataObject, again: bool) -> None:
        index = data.draw(st.integers(0, len(self.on_the_way) - 1))
        self.take(self.on_the_way[index] if again else self.on_the_way.pop(index))

    @precondition(lambda self: self.on_the_way)
    @rule(data=st.data())
    def a_chunk_is_lost(self, data: st.DataObject) -> None:
        self.on_the_way.pop(data.draw(st.integers(0, len(self.on_the_way) - 1)))

    @rule()
    def changes_stop(self) -> None:
        """A ping arrives, then the answer to what is asked for: no more is ever needed."""
        self.replica.hear(self.ledger.state)
        if self.replica.must_ask:
            for chunk in self.ledger.read(self.replica.epoch, self.replica.since):
                self.take(chunk)
        assert not self.replica.must_ask
        assert self.replica.revision == self.ledger.state.revision
        assert self.replica.entries == self.model

    def take(self, chunk: Chunk) -> None:
        change = self.replica.take(chunks.parse(chunk.to_body()))
        if change is None:
            return
        if change.is_whole:
            self.seen = {}
        for key, entry in change.changes.items():
            self.seen.pop(key, None)
            if entry is not None:
                self.seen[key] = entry

    @invariant()
    def it_is_always_what_the_ledger_was(self) -> None:
        if self.replica.revision:
            assert self.replica.entries == self.history[self.replica.epoch, self.replica.revision]
        assert self.replica.entries == self.seen


TestTold = Told.TestCase


def replica_of(ledger: Ledger) -> Replica:
    replica = Replica(ledger.epoch)
    for chunk in ledger.whole():
        replica.take(chunk)
    assert not replica.must_ask
    return replica


def test_nothing_new_is_no_change() -> None:
    ledger = Ledger(7)
    ledger.publish({"fact/a": {"holds": True}})
    replica = replica_of(ledger)
    assert [replica.take(chunk) for chunk in ledger.read(7, replica.since)] == [None]
    assert [replica.take(chunk) for chunk in ledger.whole()] == [None]


def test_gap_is_asked_for() -> None:
    ledger = Ledger(7)
    replica = replica_of(ledger)
    ledger.publish({"fact/a": {"holds": True}})
    missed = ledger.state.revision
    ledger.publish({"fact/b": {"holds": True}})
    (late,) = ledger.delta(missed) or ()
    assert replica.take(late) is None
    assert replica.must_ask
    (whole,) = ledger.read(7, replica.since)
    assert replica.take(whole) == Change(
        {"fact/b": {"holds": True}, "fact/a": {"holds": True}}, is_whole=False
    )


def test_other_digest_of_the_same_revision_asks_for_the_whole() -> None:
    ledger = Ledger(7)
    ledger.publish({"fact/a": {"holds": True}})
    replica = replica_of(ledger)
    replica.hear(State(ledger.state.revision, b"otherwis"))
    assert (replica.must_ask, replica.since) == (True, 0)
    assert [replica.take(chunk) for chunk in ledger.whole()] == [
        Change({"fact/a": {"holds": True}}, is_whole=True)
    ]
    assert not replica.must_ask


def test_delta_with_a_wrong_digest_changes_nothing_and_asks_for_the_whole() -> None:
    ledger = Ledger(7)
    replica = replica_of(ledger)
    ledger.publish({"fact/a": {"holds": True}})
    (delta,) = ledger.delta(1) or ()
    assert replica.take(replace(delta, state=replace(delta.state, digest=b"otherwis"))) is None
    assert (dict(replica.entries), replica.since, replica.must_ask) == ({}, 0, True)


def test_whole_with_a_wrong_digest_is_a_violation() -> None:
    ledger = Ledger(7)
    ledger.publish({"fact/a": {"holds": True}})
    (whole,) = ledger.whole()
    replica = Replica(7)
    with pytest.raises(ProtocolViolation, match="digest"):
        replica.take(replace(whole, state=replace(whole.state, digest=b"otherwis")))
    assert (dict(replica.entries), replica.must_ask) == ({}, True)


@pytest.mark.parametrize(
    "packed",
    [b"\xc1", pack([1]), pack(7), b"", b"\x81\xa1a\xcb\x7f\xf8\0\0\0\0\0\0"],
    ids=["no msgpack", "list", "number", "nothing", "not a number"],
)
def test_entry_that_is_no_table_is_a_violation(packed: bytes) -> None:
    replica = Replica(7)
    digest = chunks.digest_of("fact/a", packed).to_bytes(DIGEST_BYTES)
    with pytest.raises(ProtocolViolation):
        replica.take(Chunk(7, 0, State(2, digest), 0, 1, {"fact/a": packed}))
    assert (replica.revision, replica.entries) == (0, {})


def test_catalogue_beyond_its_limit_is_a_violation(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(replicas, "MAX_CATALOGUE", 100)
    ledger = Ledger(7)
    replica = replica_of(ledger)
    ledger.publish({"fact/a": {"text": "x" * 100}})
    (delta,) = ledger.delta(1) or ()
    with pytest.raises(ProtocolViolation):
        replica.take(delta)
    assert dict(replica.entries) == {}


def test_what_was_handed_out_never_changes() -> None:
    ledger = Ledger(7)
    replica = replica_of(ledger)
    before = replica.entries
    ledger.publish({"fact/a": {"holds": True}})
    for chunk in ledger.delta(1) or ():
        replica.take(chunk)
    assert (dict(before), dict(replica.entries)) == ({}, {"fact/a": {"holds": True}})

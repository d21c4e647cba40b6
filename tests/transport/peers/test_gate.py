"""What is asked at the handshake, and at every message of a link."""

from __future__ import annotations

import asyncio
import contextlib
from datetime import UTC, datetime

import pytest
import zmq
from tests.transport.peers.dealers import hello_of, raw_dealer
from tests.transport.peers.hosts import PATIENCE_S, Servant, host, identity, trusting, two_hosts

from nondum.transport.peers import (
    HostKeys,
    Identity,
    Loss,
    PeerKey,
    PeerLost,
    PeerNode,
    PeerRefused,
    PeerUp,
    Reason,
    Trust,
    local_sockets,
    node,
)
from nondum.transport.peers.certificate import new_fleet
from nondum.transport.peers.gate import Acquaintance, Gate, TurnedAway, judge
from nondum.transport.peers.messages import Hello, Notice, Ping, encode
from nondum.transport.peers.zap import DOMAIN, ConnectionAttempt, parse

ME, PAIRED, REVOKED, OTHER = (HostKeys.generate() for _ in range(4))
TRUST = Trust(paired={PAIRED.public: "rover"}).with_revoked(REVOKED.public, "stolen")
FLEET, _ = new_fleet()


def judged(
    attempt: ConnectionAttempt, trust: Trust = TRUST, keys: HostKeys | None = ME
) -> Reason | None:
    return judge(attempt, Identity("base", keys), trust)


def attempt(
    key: PeerKey | str, *, domain: bytes = DOMAIN, mechanism: str = "CURVE", at: str = "10.0.0.7"
) -> ConnectionAttempt:
    return ConnectionAttempt(at, domain, mechanism, key)


@pytest.mark.parametrize(
    ("asked", "reason"),
    [
        (attempt(PAIRED.public), None),
        (attempt(PAIRED.public, domain=b"another"), Reason.WRONG_DOMAIN),
        (attempt(PAIRED.public, domain=b""), Reason.WRONG_DOMAIN),
        (attempt(PAIRED.public, mechanism="PLAIN"), Reason.MISMATCH),
        (attempt("", mechanism="NULL"), Reason.MISMATCH),
        (attempt(ME.public), Reason.DUPLICATE),
        (attempt(REVOKED.public), Reason.REVOKED),
        (attempt(OTHER.public), Reason.UNKNOWN_KEY),
    ],
)
def test_handshake_is_judged_by_domain_mechanism_and_key(
    asked: ConnectionAttempt, reason: Reason | None
) -> None:
    assert judged(asked) is reason


def test_own_key_is_turned_away_even_if_it_is_paired() -> None:
    assert judged(attempt(ME.public), Trust(paired={ME.public: "base"})) is Reason.DUPLICATE


def test_unknown_key_may_greet_a_host_of_a_fleet() -> None:
    assert judged(attempt(OTHER.public), TRUST.with_fleet(FLEET, "survey")) is None
    assert judged(attempt(REVOKED.public), TRUST.with_fleet(FLEET, "survey")) is Reason.REVOKED


@pytest.mark.parametrize(
    ("asked", "reason"),
    [
        (attempt("", mechanism="NULL", at="127.0.0.1"), None),
        (attempt("", mechanism="NULL", at="10.0.0.7"), Reason.MISMATCH),
        (attempt(PAIRED.public, at="127.0.0.1"), Reason.MISMATCH),
        (attempt("", mechanism="NULL", at="127.0.0.1", domain=b""), Reason.WRONG_DOMAIN),
    ],
)
def test_host_without_keys_is_met_on_this_machine_only(
    asked: ConnectionAttempt, reason: Reason | None
) -> None:
    assert judged(asked, keys=None) is reason


def hello(key: PeerKey, *, epoch: int = 7, term: int = 1) -> Hello:
    return Hello((1,), "rover", key, epoch, term, b"")


def test_life_of_a_peer_that_is_over_does_not_come_back() -> None:
    known = Acquaintance()
    assert known.meet(hello(PAIRED.public, epoch=1))
    assert not known.meet(hello(PAIRED.public, epoch=1))
    assert known.meet(hello(PAIRED.public, epoch=2, term=3))
    for old in (hello(PAIRED.public, epoch=1), hello(PAIRED.public, epoch=2, term=2)):
        with pytest.raises(TurnedAway) as away:
            known.meet(old)
        assert away.value.reason is Reason.DUPLICATE


@pytest.mark.parametrize(
    ("key", "proved", "reason"),
    [
        (ME, ME, Reason.DUPLICATE),
        (PAIRED, OTHER, Reason.NOT_PROVED),
        (PAIRED, None, Reason.NOT_PROVED),
        (REVOKED, REVOKED, Reason.REVOKED),
        (OTHER, OTHER, Reason.UNKNOWN_KEY),
    ],
)
def test_greeting_is_turned_away_for_its_key(
    key: HostKeys, proved: HostKeys | None, reason: Reason
) -> None:
    trust = Trust(paired={**TRUST.paired, ME.public: "base"}, revoked=TRUST.revoked)
    gate = Gate(Identity("base", ME), trust, lambda: datetime.now(UTC))
    assert gate.admit(hello(PAIRED.public), PAIRED.public).name == "rover"
    with pytest.raises(TurnedAway) as away:
        gate.admit(hello(key.public), proved.public if proved else None)
    assert away.value.reason is reason


@pytest.mark.anyio
async def test_host_listens_at_addresses_of_this_machine_only() -> None:
    with pytest.raises(PeerRefused, match="ADDRESS_UNUSABLE"):
        async with host(identity("base"), address="tcp://203.0.113.9:0"):
            pass


@pytest.mark.anyio
async def test_address_that_is_taken_is_named_among_those_to_listen_at() -> None:
    async with host(identity("base")) as there:
        other = PeerNode(identity("rover"), Trust(), Servant(), on_event=lambda _: None)
        try:
            with pytest.raises(PeerRefused, match="ADDRESS_UNUSABLE") as refused:
                await other.start(["tcp://127.0.0.1:0", there.address])
        finally:
            await other.close()
    assert refused.value.problems[0].where == there.address


@pytest.mark.anyio
async def test_link_begins_with_a_greeting_and_has_no_other() -> None:
    base, rover = identity("base"), identity("rover")
    async with host(base, trusting(rover)) as there:
        with raw_dealer(there, rover) as rude:
            rude.send(encode(Ping(1)))
            await there.counted(Reason.GARBAGE)
            assert not there.node.peers
        with raw_dealer(there, rover) as twice:
            twice.send(hello_of(rover))
            await there.told(PeerUp, rover.key)
            twice.send(hello_of(rover))
            assert (await there.told(PeerLost)).reason is Loss.VIOLATED
            await there.counted(Reason.GARBAGE, 2)


@pytest.mark.anyio
async def test_two_peers_of_one_name_are_not_both_let_in() -> None:
    base, rover, other = identity("base"), identity("rover"), identity("rover")
    async with host(base, trusting(rover, other)) as there:
        with raw_dealer(there, rover) as first, raw_dealer(there, other) as second:
            first.send(hello_of(rover))
            await there.told(PeerUp, rover.key)
            second.send(hello_of(other))
            await there.counted(Reason.DUPLICATE)
            assert list(there.node.peers) == [rover.key]


@pytest.mark.anyio
async def test_message_under_a_key_that_was_revoked_meanwhile_is_not_read() -> None:
    """Also if the link was not cut yet."""
    async with two_hosts() as (rover, base):
        base.node._gate.trust = trusting(rover.node.identity).with_revoked(rover.key, "stolen")
        rover.node.notify(base.key, "hear", {})
        assert (await base.told(PeerLost)).reason is Loss.REVOKED
        assert base.servant.notices.empty()


@pytest.mark.anyio
async def test_peer_that_is_no_longer_trusted_is_cut_at_once() -> None:
    async with two_hosts() as (rover, base):
        base.node.set_trust(Trust())
        assert (await base.told(PeerLost)).reason is Loss.REVOKED
        assert rover.key not in base.node.peers


@pytest.mark.parametrize(
    "frames",
    [
        [b"2.0", b"1", DOMAIN, b"10.0.0.7", b"", b"NULL"],
        [b"1.0", b"1", DOMAIN, b"10.0.0.7"],
        [b"1.0", b"1", DOMAIN, b"10.0.0.7", b"", b"CURVE"],
    ],
    ids=["version", "short", "no key"],
)
def test_question_that_zeromq_does_not_ask_is_malformed(frames: list[bytes]) -> None:
    with pytest.raises(ValueError):
        parse(frames)


@pytest.mark.anyio
async def test_message_under_another_key_than_the_links_is_not_read(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Two peers may choose one routing id: the second takes the place of the first as it goes."""
    for module in (node, local_sockets):  # what is over is looked for no more
        monkeypatch.setattr(module, "BEAT_S", 3600.0)
    base, rover, other = identity("base"), identity("rover"), identity("other")
    async with host(base, trusting(rover, other)) as there, asyncio.timeout(PATIENCE_S):
        with raw_dealer(there, rover, routing_id=b"chosen") as first:
            first.send(hello_of(rover))
            await there.told(PeerUp, rover.key)
        with raw_dealer(there, other, routing_id=b"chosen") as second:
            while not there.node.refusals.counts.get(Reason.NOT_PROVED):
                with contextlib.suppress(zmq.Again):  # as many wait as may
                    second.send(encode(Notice("hear", {})), zmq.NOBLOCK)
                await asyncio.sleep(0)
        assert there.servant.notices.empty()

"""Peers that tell too much of themselves, or nothing: others are read as ever."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Awaitable
from dataclasses import dataclass, field, replace
from typing import Any

import pytest
from tests.transport.fleet.fleets import Member, mesh_member
from tests.transport.peers.hosts import identity, trusting

from nondum.sdk.wire import Body
from nondum.transport.fleet import Mesh, PeerChanged, catalogues
from nondum.transport.fleet.catalogues import CHANGED, READ
from nondum.transport.fleet.ledger import Ledger
from nondum.transport.peers import (
    Admission,
    CallFailed,
    Identity,
    IncomingCall,
    Lease,
    Loss,
    PeerKey,
    PeerLost,
    PeerNode,
    PeerUnreachable,
    Reason,
    Refusal,
    Trust,
)
from nondum.transport.peers.pulse import DIGEST_BYTES, State

pytestmark = pytest.mark.anyio

CAMERA = {"component/camera": {"units": ["camera"]}}


@dataclass
class Teller:
    """Answers requests for a catalogue, or never does."""

    ledger: Ledger = field(default_factory=lambda: Ledger(7))
    is_mute: bool = False
    asked: asyncio.Event = field(default_factory=asyncio.Event)

    def serve(self, incoming: IncomingCall) -> Body | Awaitable[Body]:
        assert incoming.method == READ
        self.asked.set()
        if self.is_mute:
            return self._never()
        (whole,) = self.ledger.whole()
        return whole.to_body()

    def notice(self, caller: Admission, method: str, args: dict[str, Any]) -> None: ...

    def orphaned(self, incoming: IncomingCall, reason: Loss) -> Lease:
        return Lease.STOP

    async def _never(self) -> Body:
        await asyncio.Event().wait()
        raise AssertionError


class LyingLedger(Ledger):
    """Tells a digest that does not match its entries."""

    @property
    def state(self) -> State:
        return replace(super().state, digest=b"x" * DIGEST_BYTES)


@contextlib.asynccontextmanager
async def bare_peer(me: Identity, other: Member, teller: Teller) -> AsyncIterator[PeerNode]:
    """A peer of a mesh: a node alone, without the mesh's catalogues."""
    assert isinstance(other.fleet, Mesh)
    trust = Trust(paired={other.key: other.name})
    node = PeerNode(me, trust, teller, on_event=lambda _: None, epoch=teller.ledger.epoch)
    await node.start([])
    node.dial(other.key, other.fleet.addresses)
    try:
        yield node
    finally:
        await node.close()


@contextlib.asynccontextmanager
async def meshed(me: Identity, *others: Identity) -> AsyncIterator[Member]:
    mesh, member = mesh_member(me.name, me.keys, trusting(*others))
    await mesh.start()
    try:
        yield member
    finally:
        await mesh.close()


async def test_wrong_catalogue_has_its_host_cut() -> None:
    """A host that was let in, and lies about the digest of what it tells."""
    base, liar = identity("base"), identity("liar")
    async with meshed(base, liar) as here, bare_peer(liar, here, Teller(LyingLedger(7))):
        assert (await here.told(PeerLost)).reason is Loss.VIOLATED
        assert not [event for event in here.events if isinstance(event, PeerChanged)]
        refused = [event for event in here.events if isinstance(event, Refusal)]
        assert refused[0].reason is Reason.GARBAGE


@pytest.mark.parametrize(
    "args",
    [{"epoch": "7", "revision": 0}, {"epoch": 7, "revision": None}, {"epoch": 7}, {"revision": 0}],
    ids=str,
)
async def test_odd_question_for_a_catalogue_is_refused(args: Body) -> None:
    base, rover = identity("base"), identity("rover")
    async with meshed(base, rover) as here, bare_peer(rover, here, Teller()) as node:
        await here.sees(PeerKey(node.identity.key), {})
        with pytest.raises(CallFailed) as failed:
            await node.call(here.key, READ, args, deadline_s=60.0)
        assert failed.value.code == "PACKET_FIELDS"


async def test_peers_that_never_answer_do_not_delay_other_peers(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(catalogues, "READ_S", 3600.0)
    mutes = [identity(f"mute-{number}") for number in range(catalogues.AT_ONCE + 1)]
    base, rover = identity("base"), identity("rover")
    async with meshed(base, rover, *mutes) as here, contextlib.AsyncExitStack() as stack:
        tellers = [Teller(is_mute=True) for _ in mutes]
        for me, teller in zip(mutes, tellers, strict=True):
            await stack.enter_async_context(bare_peer(me, here, teller))
        await asyncio.gather(*(teller.asked.wait() for teller in tellers))
        there = await stack.enter_async_context(meshed(rover, base))
        there.fleet.publish(CAMERA)
        assert isinstance(there.fleet, Mesh)
        there.fleet.meet(here.key, here.fleet.addresses)  # type: ignore[attr-defined]  # a mesh
        await here.sees(there, CAMERA)


async def told_at_last(node: PeerNode, peer: PeerKey, change: Body) -> None:
    """Tell a change as soon as the link can take it."""
    while True:
        try:
            return node.notify(peer, CHANGED, change)
        except PeerUnreachable:
            await asyncio.sleep(0)


async def test_changes_beyond_all_measure_are_read_when_there_is_time(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(catalogues, "CHANGES", 10.0)
    monkeypatch.setattr(catalogues, "CHANGES_PER_S", 10.0)
    base, rover = identity("base"), identity("rover")
    teller = Teller()
    async with meshed(base, rover) as here, bare_peer(rover, here, teller) as node:
        await here.sees(rover_key := PeerKey(node.identity.key), {})
        for number in range(500):
            told = teller.ledger.state.revision
            teller.ledger.publish({"fact/number": {"is": number}})
            for chunk in teller.ledger.delta(told) or ():
                await told_at_last(node, here.key, chunk.to_body())
        await here.sees(rover_key, {"fact/number": {"is": 499}})
        assert sum(isinstance(event, PeerChanged) for event in here.events) < 50

"""Peers that go, hang, come back, or are there twice."""

from __future__ import annotations

import asyncio
import os
import signal
from collections.abc import AsyncIterator

import pytest
from tests.kit.clock import VirtualClock
from tests.transport.peers.hosts import (
    PATIENCE_S,
    Child,
    Host,
    child,
    host,
    identity,
    raises,
    trusting,
    two_hosts,
    up,
)

from nondum.transport.peers import DialFailed, HostKeys, Lease, Loss, PeerLost, PeerUp, Reason

pytestmark = pytest.mark.anyio


@pytest.fixture
async def pair() -> AsyncIterator[tuple[Host, Child]]:
    """A host here, linked to one in a separate process."""
    keys, me = HostKeys.generate(), identity("rover")
    with child(keys, [me]) as other:
        async with host(me, trusting(identity("child", keys))) as here:
            here.node.dial(other.key, [other.address])
            await here.told(PeerUp)
            yield here, other


@pytest.mark.usefixtures("each_kind_of_sockets")
async def test_departure_is_announced() -> None:
    rover, base = identity("rover"), identity("base")
    async with host(rover, trusting(base)) as here:
        async with host(base, trusting(rover)) as there:
            here.node.dial(there.key, [there.address])
            await up(here, there)
        assert (await here.told(PeerLost)).reason is Loss.DEPARTED


@pytest.mark.usefixtures("each_kind_of_sockets")
async def test_killed_peer_is_lost_and_calls_to_it_fail(pair: tuple[Host, Child]) -> None:
    here, other = pair
    call = here.node.call(other.key, "wait", {}, deadline_s=600)
    other.process.kill()
    assert (await here.told(PeerLost)).reason is Loss.DISCONNECTED
    assert await raises(lambda: call) == ["PEER_LOST"]
    assert other.key not in here.node.peers


@pytest.mark.usefixtures("each_kind_of_sockets")
async def test_stopped_peer_is_lost_and_comes_back(pair: tuple[Host, Child]) -> None:
    here, other = pair
    call = here.node.call(other.key, "wait", {}, deadline_s=600)
    os.kill(other.process.pid, signal.SIGSTOP)
    assert (await here.told(PeerLost)).reason is Loss.SILENT
    assert await raises(lambda: call) == ["PEER_LOST"]
    os.kill(other.process.pid, signal.SIGCONT)
    await here.told(PeerUp)
    assert await here.node.call(other.key, "echo", {"a": 1}, deadline_s=5) == {"a": 1}


async def test_hung_loop_is_noticed(pair: tuple[Host, Child]) -> None:
    here, other = pair
    call = here.node.call(other.key, "hang", {"seconds": 3}, deadline_s=600)
    assert (await here.told(PeerLost)).reason is Loss.SILENT
    assert await raises(lambda: call) == ["PEER_LOST"]
    await here.told(PeerUp)


async def test_call_to_a_stopped_peer_is_not_carried_out_later(pair: tuple[Host, Child]) -> None:
    """What waited in buffers while the peer was lost belongs to a link that is over."""
    here, other = pair
    os.kill(other.process.pid, signal.SIGSTOP)
    stale = [here.node.call(other.key, "hang", {"seconds": 60}, deadline_s=600) for _ in range(5)]
    await here.told(PeerLost)
    assert [await raises(lambda c=call: c) for call in stale] == [["PEER_LOST"]] * 5  # type: ignore[misc]  # c is bound
    os.kill(other.process.pid, signal.SIGCONT)
    await here.told(PeerUp)
    assert await here.node.call(other.key, "echo", {}, deadline_s=5) == {}


async def test_restarted_peer_has_a_new_epoch() -> None:
    keys, me = HostKeys.generate(), identity("rover")
    async with host(me, trusting(identity("child", keys))) as here:
        with child(keys, [me]) as first:
            here.node.dial(first.key, [first.address])
            before = (await here.told(PeerUp)).epoch
            port = int(first.address.rpartition(":")[2])
            first.process.kill()
            first.process.wait()
            with child(keys, [me], port=port):
                assert (await here.told(PeerLost)).reason in (Loss.RESTARTED, Loss.DISCONNECTED)
                assert (await here.told(PeerUp)).epoch != before


@pytest.mark.parametrize(
    ("lease", "outcome"),
    [(Lease.STOP, "cancelled"), (Lease.HOLD, "finished"), (Lease.FINISH, "finished")],
    ids=lambda value: str(value),
)
async def test_call_of_a_lost_caller_follows_its_lease(lease: Lease, outcome: str) -> None:
    rover, base = identity("rover"), identity("base")
    async with host(base, trusting(rover)) as there:
        there.servant.lease = lease
        async with host(rover, trusting(base)) as here:
            here.node.dial(there.key, [there.address])
            await up(here, there)
            here.node.call(there.key, "wait", {}, deadline_s=600)
            incoming = await there.servant.running.get()
        assert await asyncio.wait_for(there.servant.lost.get(), PATIENCE_S) is Loss.DEPARTED
        if lease is not Lease.STOP:
            await asyncio.wait_for(incoming.orphaned.wait(), PATIENCE_S)
            there.servant.gate.set()
        assert await asyncio.wait_for(there.servant.ended.get(), PATIENCE_S) == outcome


@pytest.mark.parametrize("lease", [Lease.FINISH, Lease.HOLD], ids=lambda value: str(value))
async def test_only_a_held_call_outlives_its_deadline(lease: Lease, clock: VirtualClock) -> None:
    rover, base = identity("rover"), identity("base")
    async with host(base, trusting(rover)) as there:
        there.servant.lease = lease
        async with host(rover, trusting(base)) as here:
            here.node.dial(there.key, [there.address])
            await up(here, there)
            here.node.call(there.key, "wait", {}, deadline_s=1)
            incoming = await there.servant.running.get()
        await asyncio.wait_for(incoming.orphaned.wait(), PATIENCE_S)
        await clock.advance(10.0)
        if lease is Lease.FINISH:
            assert there.servant.ended.get_nowait() == "cancelled"
        else:
            assert there.servant.ended.empty()


@pytest.mark.usefixtures("each_kind_of_sockets")
async def test_broken_connection_is_resumed_and_nothing_runs_twice() -> None:
    async with two_hosts() as (rover, base):
        call = rover.node.call(base.key, "wait", {"tag": "once"}, deadline_s=60)
        await base.servant.running.get()
        for _ in range(3):
            await break_links(rover, base)
            assert await rover.node.call(base.key, "echo", {}, deadline_s=5) == {}
        base.servant.gate.set()
        assert await call == {"waited": True}
        assert base.servant.served.count("once") == 1
        assert base.servant.lost.empty()


async def test_answer_given_while_the_link_was_broken_arrives() -> None:
    async with two_hosts() as (rover, base):
        call = rover.node.call(base.key, "wait", {"tag": "once"}, deadline_s=60)
        await base.servant.running.get()
        base.servant.gate.set()
        await break_links(rover, base)
        assert await call == {"waited": True}
        assert base.servant.served.count("once") == 1


async def test_calls_made_while_the_link_is_broken_are_sent_later() -> None:
    async with two_hosts() as (rover, base):
        await break_links(rover, base)
        answers = await asyncio.gather(
            *(rover.node.call(base.key, "echo", {"n": n}, deadline_s=5) for n in range(20))
        )
        assert [answer["n"] for answer in answers] == list(range(20))
        assert len(base.servant.served) == 20


async def test_second_host_with_the_same_key_is_told_and_the_newest_stays() -> None:
    base, rover = identity("base"), identity("rover")
    copy = identity("rover", rover.keys)
    async with (
        host(base, trusting(rover)) as there,
        host(rover, trusting(base)) as first,
        host(copy, trusting(base)) as second,
    ):
        first.node.dial(there.key, [there.address])
        await up(first, there)
        second.node.dial(there.key, [there.address])
        await second.told(PeerUp)
        assert (await there.told(PeerLost)).reason is Loss.RESTARTED
        assert (await first.told(DialFailed)).problem.code == "PEER_DUPLICATE"
        assert there.node.refusals.counts[Reason.DUPLICATE] >= 1
        assert await second.node.call(there.key, "echo", {}, deadline_s=5) == {}


async def test_host_does_not_become_its_own_peer() -> None:
    me = identity("rover")
    async with host(me, trusting(identity("other"))) as here:
        here.node.dial(here.key, [here.address])
        assert (await here.told(DialFailed)).problem.code == "PEER_TURNED_AWAY"
        assert here.node.refusals.counts == {Reason.DUPLICATE: 1}


async def break_links(one: Host, other: Host) -> None:
    """Break the connections beneath the links, as a network would."""
    for node in (one.node, other.node):
        for route in node.accepted:
            route.cut()

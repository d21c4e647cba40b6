"""Incomplete messages on a link are bounded, on accepted and dialled connections.

Proper messages are never taken for incomplete ones.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import socket
from collections.abc import Iterator

import pytest
import zmq
from tests.kit.clock import VirtualClock
from tests.kit.until import until, until_async
from tests.transport.peers.bad_ends import bad_dealer, bad_router, greeting, hello_of
from tests.transport.peers.held_back import held_back
from tests.transport.peers.hosts import PATIENCE_S, Host, host, identity, trusting, two_hosts, up

from nondum.transport.peers import (
    Identity,
    Loss,
    PeerLost,
    PeerUp,
    Reason,
    drained,
    local_sockets,
    tcp,
)
from nondum.transport.peers.dial import Attempt
from nondum.transport.peers.local_sockets import LOOK_S
from nondum.transport.peers.messages import MAX_MESSAGE, Welcome, encode
from nondum.transport.peers.received import MOST_AHEAD, Received
from nondum.transport.peers.routes import AcceptedRoute, DialledRoute

pytestmark = pytest.mark.anyio

PART = b"x" * 60_000
PARTS = 40
PASSES = 2 * MOST_AHEAD
"""Bytes that a relay lets through: no message ends within them, and they are far too many."""
ALL = 1 << 40
HANDSHAKE = 1024
"""More than the bytes that a connection begins with."""


@pytest.mark.usefixtures("each_kind_of_sockets")
@pytest.mark.parametrize("is_greeted", [True, False], ids=["peer", "before its greeting"])
async def test_message_without_end_of_an_admitted_host_is_cut(is_greeted: bool) -> None:
    base, rover, other = identity("base"), identity("rover"), identity("other")
    async with (
        host(base, trusting(rover, other)) as there,
        host(other, trusting(base)) as good,
        held_back(there.address, to_it=PASSES, from_it=ALL) as address,
        asyncio.timeout(PATIENCE_S),
    ):
        good.node.dial(there.key, [there.address])
        await up(good, there)
        with bad_dealer(address, rover, there) as bad:
            if is_greeted:
                bad.send(hello_of(rover))
                await there.told(PeerUp, rover.key)
            bad.send_multipart([PART] * PARTS)
            if is_greeted:
                await there.counted(Reason.ENDLESS)
                assert (await there.told(PeerLost)).reason is Loss.VIOLATED
                told = there.node.refusals.latest[0]
                assert (told.key, told.told.split()[0]) == (rover.key, "PEER_ENDLESS")
                assert "rover" in told.told
            else:
                await there.counted(Reason.SILENT)
        assert await good.node.call(there.key, "echo", {}, deadline_s=5) == {}
        assert good.key in there.node.peers


@pytest.mark.usefixtures("each_kind_of_sockets")
@pytest.mark.parametrize("is_greeted", [True, False], ids=["peer", "before its greeting"])
async def test_message_without_end_of_a_dialled_host_is_cut(is_greeted: bool) -> None:
    base, rover = identity("base"), identity("rover")
    with bad_router(base) as (bad, where):
        async with (
            host(rover, trusting(base)) as here,
            held_back(where, to_it=ALL, from_it=PASSES) as address,
            asyncio.timeout(PATIENCE_S),
        ):
            here.node.dial(base.key, [address])
            routing_id, _ = await asyncio.to_thread(bad.recv_multipart)
            if is_greeted:
                bad.send_multipart([routing_id, encode(Welcome(greeting(base)))])
                await here.told(PeerUp)
            bad.send_multipart([routing_id, *[PART] * PARTS])
            await here.counted(Reason.ENDLESS)
            assert here.node.refusals.latest[0].key == base.key
            if is_greeted:
                assert (await here.told(PeerLost)).reason is Loss.VIOLATED


async def test_host_that_sent_a_message_without_end_stays_out_for_a_while() -> None:
    base, rover = identity("base"), identity("rover")
    async with (
        host(base, trusting(rover)) as there,
        held_back(there.address, to_it=PASSES, from_it=ALL) as address,
        asyncio.timeout(PATIENCE_S),
    ):
        with bad_dealer(address, rover, there) as bad:
            bad.send(hello_of(rover))
            bad.send_multipart([PART] * PARTS)
            await there.counted(Reason.ENDLESS)
        with bad_dealer(there.address, rover, there) as bad:
            bad.send(hello_of(rover, term=2))
            await there.counted(Reason.FLOODING)
        assert rover.key not in there.node.peers


async def test_peer_that_was_turned_away_has_no_time_for_a_message_without_end(
    clock: VirtualClock,
) -> None:
    """It could hear the reason for a while yet."""
    base, rover = identity("base"), identity("rover")
    async with (
        host(base, trusting(rover)) as there,
        held_back(there.address, to_it=PASSES, from_it=ALL) as address,
    ):
        with bad_dealer(address, rover, there) as bad:
            ended = bad.get_monitor_socket(zmq.EVENT_DISCONNECTED)
            bad.send(hello_of(rover))
            await there.told(PeerUp, rover.key)
            (route,) = there.node.accepted
            bad.send(b"garbage")
            assert (await there.told(PeerLost)).reason is Loss.VIOLATED
            bad.send_multipart([PART] * PARTS)
            before = bytes_received(route)
            await until_async("it has come", lambda: bytes_received(route) > before + MOST_AHEAD)
            await clock.advance(LOOK_S)
            assert await asyncio.to_thread(ended.poll, int(PATIENCE_S * 1000))
            ended.close(0)


@pytest.mark.parametrize("at_once", [5, 1000], ids=["slowly", "at once"])
async def test_what_waits_while_this_host_hangs_is_not_taken_for_a_message_without_end(
    at_once: int, clock: VirtualClock, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its time stands still, so that it does not take its peer for lost."""
    monkeypatch.setattr(local_sockets, "LOOK_S", 0.0)  # each turn of the loop
    monkeypatch.setattr(drained, "AT_ONCE", at_once)
    async with two_hosts() as (rover, base):
        (route,) = base.node.accepted
        before = bytes_received(route)
        for _ in range(100):
            rover.node.notify(base.key, "values", {"text": "x" * 100_000})
        until("far more has come", lambda: bytes_received(route) - before > 8 * MOST_AHEAD)
        for _ in range(100):
            await base.servant.notices.get()
        assert base.node.refusals.counts == {}
        assert rover.key in base.node.peers


@pytest.mark.parametrize("is_secured", [True, False], ids=["CURVE", "without keys"])
async def test_account_of_a_link_is_exact(is_secured: bool) -> None:
    """One that were not would let a peer save up for a message without end, or cut a good one."""
    rover = identity("rover") if is_secured else Identity("rover", None)
    base = identity("base") if is_secured else Identity("base", None)
    async with host(base, trusting(rover)) as there, host(rover, trusting(base)) as here:
        here.node.dial(there.key, [there.address])
        await up(here, there)
        accounts = [*accounts_of(here), *accounts_of(there)]
        assert len(accounts) == 2
        for length in (0, 100, 190, 300, 1000, 70_000):
            text = "x" * length
            for _ in range(100):
                await here.node.call(there.key, "echo", {"text": text}, deadline_s=PATIENCE_S)
        for account in accounts:
            assert 0 <= account.ahead(account.read()) < HANDSHAKE


async def test_bytes_that_are_no_messages_cannot_be_saved_up() -> None:
    """What is delivered counts for no more than what came."""
    with connection() as (here, there):
        account = Received(there.fileno(), is_sealed=True)
        here.sendall(b"x" * 1000)
        there.recv(1000, socket.MSG_WAITALL)
        account.delivered([zmq.Frame(b"x" * MAX_MESSAGE)] * 10)
        assert account.ahead(account.read()) == 0
        here.sendall(b"x" * 500)
        assert there.recv(500, socket.MSG_WAITALL)
        assert account.ahead(account.read()) == 500


async def test_bytes_that_wait_in_the_kernel_are_not_this_process_s() -> None:
    with connection() as (here, there):
        account = Received(there.fileno(), is_sealed=False)
        here.sendall(b"x" * 5000)
        until("they have come", lambda: state_of(there).bytes_received == 5000)
        assert state_of(there).bytes_read == 0
        assert account.read() == 0
        there.recv(2000, socket.MSG_WAITALL)
        assert account.read() == 2000


async def test_descriptor_of_another_connection_now_says_nothing_of_this_one() -> None:
    with connection() as (_, there):
        account = Received(there.fileno(), is_sealed=True)
        with connection() as (other_here, other_there):
            os.dup2(other_there.fileno(), there.fileno())
            other_here.sendall(b"x" * 5000)
            other_there.recv(5000, socket.MSG_WAITALL)
            assert state_of(there).bytes_read == 5000
            assert account.read() == 0


async def test_account_that_began_with_the_descriptor_of_a_later_connection_is_closed() -> None:
    """Its own connection was gone when its message was read; another had its number already."""
    with connection() as (here, there):
        early = Received(there.fileno(), is_sealed=True)
        late = Received(there.fileno(), is_sealed=True)
        early.yield_to(late)
        here.sendall(b"x" * 5000)
        there.recv(5000, socket.MSG_WAITALL)
        assert (early.read(), late.read()) == (0, 5000)


def state_of(connection: socket.socket) -> tcp.TcpState:
    state = tcp.state(connection.fileno())
    assert state is not None
    return state


def bytes_received(route: object) -> int:
    assert isinstance(route, AcceptedRoute)
    state = tcp.state(route.descriptor, route.address)
    assert state is not None
    return state.bytes_received


def accounts_of(one: Host) -> Iterator[Received]:
    for route in (*one.node.accepted, *one.node.dialled):
        if isinstance(route, Attempt):
            route = route.route
        assert isinstance(route, AcceptedRoute | DialledRoute)
        assert route.received is not None
        yield route.received


@contextlib.contextmanager
def connection() -> Iterator[tuple[socket.socket, socket.socket]]:
    """Both ends of one, on loopback."""
    with (
        socket.create_server(("127.0.0.1", 0)) as server,
        socket.create_connection(server.getsockname()) as here,
        server.accept()[0] as there,
    ):
        yield here, there

"""Before a socket is bound for others, it has turned a stranger away; or it is never bound."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator

import pytest
import zmq
from tests.kit.clock import VirtualClock

from nondum.transport.peers import HostKeys, PeerRefused
from nondum.transport.peers.drained import Drained
from nondum.transport.peers.listener import listening
from nondum.transport.peers.proof import ANSWERED_S, TICK_S, TRIES, prove_enforced
from nondum.transport.peers.zap import DOMAIN, ENDPOINT, Entry, ZapHandler

pytestmark = pytest.mark.anyio

SOON_MS = 50
"""When ZeroMQ gives up a handshake without a verdict, where a test waits for that."""


class ConnectionFilter:
    """Answers for a context's connections, when it is told to. Source: RFC 27/ZAP."""

    def __init__(self, context: zmq.Context[zmq.Socket[bytes]]) -> None:
        self.asked: asyncio.Queue[list[bytes]] = asyncio.Queue()
        socket = context.socket(zmq.ROUTER)
        socket.linger = 0
        socket.bind(ENDPOINT)
        self.socket = Drained(socket, self._on_frames)

    def turn_away(self, request: list[bytes]) -> None:
        way, empty, version, number, *_ = request
        self.socket.send([way, empty, version, number, Entry.TURNED_AWAY.value, b"", b"", b""])

    def _on_frames(self, frames: list[zmq.Frame]) -> None:
        self.asked.put_nowait([frame.bytes for frame in frames])


class Proving:
    """A host's socket that is being proved, and who answers for it."""

    def __init__(self, handshake_ms: int | None = None) -> None:
        self._context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
        self.connection_filter = ConnectionFilter(self._context)
        self._keys = HostKeys.generate()
        self._socket = listening(self._context, self._keys)
        if handshake_ms is not None:
            self._socket.setsockopt(zmq.HANDSHAKE_IVL, handshake_ms)
        self.probes: list[str] = []
        proof = prove_enforced(self._socket, self._keys, self.probes.append)
        self.proof = asyncio.ensure_future(proof)

    async def close(self) -> None:
        self.proof.cancel()
        await asyncio.gather(self.proof, return_exceptions=True)
        self._socket.close(0)
        self.connection_filter.socket.close()
        self._context.term()


@contextlib.asynccontextmanager
async def proving(handshake_ms: int | None = None) -> AsyncIterator[Proving]:
    made = Proving(handshake_ms)
    try:
        yield made
    finally:
        await made.close()


@pytest.mark.parametrize("fault", ["lets all in", "is not asked"])
async def test_socket_that_lets_strangers_in_is_never_bound(fault: str) -> None:
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    keys = HostKeys.generate()
    broken = None if fault == "is not asked" else ZapHandler(context, lambda _: Entry.LET_IN)
    sock = listening(context, keys)
    if fault == "is not asked":
        sock.setsockopt(zmq.ZAP_ENFORCE_DOMAIN, 0)
    with pytest.raises(PeerRefused, match="ZAP_INEFFECTIVE"):
        await prove_enforced(sock, keys, lambda _: None)
    sock.close()
    if broken is not None:
        broken.close()
    context.term()


async def test_socket_without_an_answer_from_the_handler_is_never_bound(
    clock: VirtualClock,
) -> None:
    async with proving() as host:
        assert DOMAIN in await host.connection_filter.asked.get()
        await clock.advance(ANSWERED_S - TICK_S)
        assert not host.proof.done()
        await clock.advance(2 * TICK_S)
        with pytest.raises(PeerRefused, match="ZAP_INEFFECTIVE"):
            await host.proof


async def test_time_in_which_the_own_loop_stands_still_is_none_to_answer_in(
    clock: VirtualClock,
) -> None:
    async with proving() as host:
        request = await host.connection_filter.asked.get()
        for _ in range(5):
            await clock.stand_still(10 * ANSWERED_S)
        host.connection_filter.turn_away(request)
        await host.proof


async def test_probe_is_sent_again_after_its_connection_ended_unanswered(
    clock: VirtualClock,
) -> None:
    """A host that stands still for longer than a handshake may take has done nothing wrong."""
    async with proving(handshake_ms=SOON_MS) as host:
        await host.connection_filter.asked.get()
        host.connection_filter.turn_away(await host.connection_filter.asked.get())
        await host.proof
        assert len(set(host.probes)) == 2


async def test_probes_are_sent_again_a_few_times_only(clock: VirtualClock) -> None:
    async with proving(handshake_ms=SOON_MS) as host:
        with pytest.raises(PeerRefused, match="ZAP_INEFFECTIVE"):
            await host.proof
        assert len(host.probes) == TRIES

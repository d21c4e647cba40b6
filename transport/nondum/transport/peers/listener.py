"""The sockets that peers meet at, with all settings, and the proof that strangers are turned away.

Why each setting: docs of zmq_setsockopt(3), and what happened without it is in the tests.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable

import zmq

from nondum.sdk.errors import Problem
from nondum.transport.peers.failures import PeerRefused
from nondum.transport.peers.keys import HostKeys, PeerKey
from nondum.transport.peers.messages import MAX_MESSAGE
from nondum.transport.peers.monitor import HANDSHAKE_FAILED, SocketEvent, Watch
from nondum.transport.peers.received import SEALED
from nondum.transport.peers.zap import DOMAIN

Context = zmq.Context[zmq.Socket[bytes]]

HIGH_WATER = 256
"""Messages that may wait in each direction of a connection: 32 MiB of the longest."""
HANDSHAKE_MS = 5000
CONNECT_MS = 3000
BACKLOG = 256
NEVER_MS = 2**30  # libzmq adds as much again at random: more would overflow
PROVED_S = 3.0
"""How long the self-test may take."""


def listening(context: Context, keys: HostKeys | None) -> zmq.Socket[bytes]:
    """A socket that others can dial, not bound yet; without keys, for development only."""
    socket = context.socket(zmq.ROUTER)
    _bound_sizes(socket)
    socket.setsockopt(zmq.ROUTER_MANDATORY, 1)  # or what a slow peer cannot take is lost in silence
    socket.setsockopt(zmq.BACKLOG, BACKLOG)
    socket.setsockopt(zmq.ZAP_DOMAIN, DOMAIN)
    socket.setsockopt(zmq.ZAP_ENFORCE_DOMAIN, 1)  # or no handler means that all are let in
    if keys is not None:
        socket.setsockopt(zmq.CURVE_SERVER, 1)
        socket.setsockopt(zmq.CURVE_SECRETKEY, keys.secret.encode("ascii"))
    return socket


def dialling(context: Context, keys: HostKeys | None, peer: PeerKey | None) -> zmq.Socket[bytes]:
    """A socket for one connection to a peer, not connected yet."""
    socket = context.socket(zmq.DEALER)
    _bound_sizes(socket)
    # One connection a socket, so that nothing old arrives late. (Not -1, and not IMMEDIATE: with
    # either, libzmq 4.3.5 drops what was received, but not read, when the connection ends: the
    # goodbye above all.)
    socket.setsockopt(zmq.RECONNECT_IVL, NEVER_MS)
    socket.setsockopt(zmq.CONNECT_TIMEOUT, CONNECT_MS)
    if keys is not None and peer is not None:
        socket.setsockopt(zmq.CURVE_PUBLICKEY, keys.public.encode("ascii"))
        socket.setsockopt(zmq.CURVE_SECRETKEY, keys.secret.encode("ascii"))
        socket.setsockopt(zmq.CURVE_SERVERKEY, peer.encode("ascii"))
    return socket


async def prove_enforced(
    socket: zmq.Socket[bytes], keys: HostKeys | None, expect: Callable[[str], None]
) -> None:
    """Dial a socket that is not bound yet, as somebody whom the handler must turn away.

    `expect` tells the handler whom. Raises `PeerRefused` (ZAP_INEFFECTIVE) when the connection was
    let in, or not answered: then the socket must not be bound.
    """
    probing = HostKeys.generate() if keys else None
    expect(probing.public if probing else "")
    turned_away: asyncio.Future[bool] = asyncio.get_running_loop().create_future()

    def on_event(event: SocketEvent) -> None:
        if not turned_away.done() and event.kind & (HANDSHAKE_FAILED | _LET_IN):
            turned_away.set_result(event.kind == zmq.EVENT_HANDSHAKE_FAILED_AUTH)

    socket.bind("tcp://127.0.0.1:*")
    address = socket.getsockopt(zmq.LAST_ENDPOINT)
    assert isinstance(address, bytes)
    probe = dialling(socket.context, probing, keys.public if keys else None)
    ears = Watch(probe, on_event)
    try:
        probe.connect(address.decode("ascii"))
        async with asyncio.timeout(PROVED_S):
            is_enforced = await turned_away
    except TimeoutError:
        is_enforced = False
    finally:
        ears.close()
        probe.close(0)
        socket.unbind(address)
    if not is_enforced:
        raise PeerRefused(
            Problem(
                "ZAP_INEFFECTIVE",
                "a key that must be turned away was let in, or nobody was asked about it: "
                "this host will not listen to peers",
                fix="look for another ZeroMQ authenticator in this process",
            )
        )


_LET_IN = zmq.EVENT_HANDSHAKE_SUCCEEDED


def _bound_sizes(socket: zmq.Socket[bytes]) -> None:
    socket.linger = 0
    socket.setsockopt(zmq.IPV6, 1)
    socket.setsockopt(zmq.MAXMSGSIZE, MAX_MESSAGE + SEALED)  # ZeroMQ counts what CURVE adds
    socket.setsockopt(zmq.HANDSHAKE_IVL, HANDSHAKE_MS)
    socket.setsockopt(zmq.SNDHWM, HIGH_WATER)
    socket.setsockopt(zmq.RCVHWM, HIGH_WATER)

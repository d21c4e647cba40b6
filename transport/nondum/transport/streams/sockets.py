"""The sockets that bridges meet at. Why each setting: `nondum.transport.peers.listener`."""

from __future__ import annotations

from collections.abc import Sequence

import zmq

from nondum.sdk.errors import Problem
from nondum.transport.peers.failures import PeerRefused
from nondum.transport.peers.keys import HostKeys, PeerKey
from nondum.transport.peers.received import SEALED
from nondum.transport.streams.packets import MAX_ASKED, PIECE
from nondum.transport.streams.window import SMALL_MESSAGES

Context = zmq.Context[zmq.Socket[bytes]]

DOMAIN = b"nondum-streams"
HIGH_WATER = 2 * SMALL_MESSAGES
"""Never reached: windows are smaller. Without a bound, what breaks them would fill the memory."""
HANDSHAKE_MS = 5000
CONNECT_MS = 3000
BACKLOG = 64
NEVER_MS = 2**30


def listening(context: Context, keys: HostKeys) -> zmq.Socket[bytes]:
    """The socket that readers dial, not bound yet."""
    socket = context.socket(zmq.ROUTER)
    _bound(socket, MAX_ASKED)
    socket.setsockopt(zmq.ROUTER_MANDATORY, 1)
    socket.setsockopt(zmq.BACKLOG, BACKLOG)
    socket.setsockopt(zmq.ZAP_DOMAIN, DOMAIN)
    socket.setsockopt(zmq.ZAP_ENFORCE_DOMAIN, 1)
    socket.setsockopt(zmq.CURVE_SERVER, 1)
    socket.setsockopt(zmq.CURVE_SECRETKEY, keys.secret.encode("ascii"))
    return socket


def dialling(context: Context, keys: HostKeys, owner: PeerKey) -> zmq.Socket[bytes]:
    """A socket for one connection to the bridge that has a stream, not connected yet."""
    socket = context.socket(zmq.DEALER)
    _bound(socket, PIECE)
    socket.setsockopt(zmq.RECONNECT_IVL, NEVER_MS)
    socket.setsockopt(zmq.CONNECT_TIMEOUT, CONNECT_MS)
    socket.setsockopt(zmq.CURVE_PUBLICKEY, keys.public.encode("ascii"))
    socket.setsockopt(zmq.CURVE_SECRETKEY, keys.secret.encode("ascii"))
    socket.setsockopt(zmq.CURVE_SERVERKEY, owner.encode("ascii"))
    return socket


def bind(socket: zmq.Socket[bytes], interfaces: Sequence[str], port: int) -> int:
    """Listen on some interfaces, at one port; 0 has the system pick it.

    Raises `PeerRefused` (ADDRESS_UNUSABLE).
    """
    for interface in interfaces:
        address = f"tcp://{interface}:{port or '*'}"
        try:
            socket.bind(address)
        except zmq.ZMQError as error:
            told = f"bridges cannot be listened for there: {error}"
            raise PeerRefused(Problem("ADDRESS_UNUSABLE", told, where=address)) from error
        bound = socket.getsockopt(zmq.LAST_ENDPOINT)
        assert isinstance(bound, bytes)
        port = int(bound.rstrip(b"\0").decode("ascii").rpartition(":")[2])
    return port


def _bound(socket: zmq.Socket[bytes], longest: int) -> None:
    socket.linger = 0
    socket.setsockopt(zmq.IPV6, 1)
    socket.setsockopt(zmq.MAXMSGSIZE, longest + SEALED)  # ZeroMQ counts what CURVE adds
    socket.setsockopt(zmq.HANDSHAKE_IVL, HANDSHAKE_MS)
    socket.setsockopt(zmq.SNDHWM, HIGH_WATER)
    socket.setsockopt(zmq.RCVHWM, HIGH_WATER)

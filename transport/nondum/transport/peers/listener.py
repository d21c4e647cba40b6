"""The sockets that peers meet at, with all settings.

Why each setting: docs of zmq_setsockopt(3), and what happened without it is in the tests.
"""

from __future__ import annotations

import zmq

from nondum.transport.peers.keys import HostKeys, PeerKey
from nondum.transport.peers.messages import MAX_MESSAGE
from nondum.transport.peers.received import SEALED
from nondum.transport.peers.zap import DOMAIN

Context = zmq.Context[zmq.Socket[bytes]]

HIGH_WATER = 256
"""Messages that may wait in each direction of a connection: 32 MiB of the longest."""
HANDSHAKE_MS = 5000
CONNECT_MS = 3000
BACKLOG = 256
NEVER_MS = 2**30  # libzmq adds as much again at random: more would overflow


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


def _bound_sizes(socket: zmq.Socket[bytes]) -> None:
    socket.linger = 0
    socket.setsockopt(zmq.IPV6, 1)
    socket.setsockopt(zmq.MAXMSGSIZE, MAX_MESSAGE + SEALED)  # ZeroMQ counts what CURVE adds
    socket.setsockopt(zmq.HANDSHAKE_IVL, HANDSHAKE_MS)
    socket.setsockopt(zmq.SNDHWM, HIGH_WATER)
    socket.setsockopt(zmq.RCVHWM, HIGH_WATER)

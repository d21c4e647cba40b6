"""What ZeroMQ tells of a socket's connections, as values. Source: zmq_socket_monitor(3)."""

from __future__ import annotations

import itertools
import struct
from collections.abc import Callable
from dataclasses import dataclass

import zmq

from nondum.transport.peers.drained import Drained

_FORMAT = struct.Struct("=HI")
_numbers = itertools.count(1)

WATCHED = (
    zmq.EVENT_ACCEPTED
    | zmq.EVENT_CLOSED
    | zmq.EVENT_CONNECT_RETRIED
    | zmq.EVENT_DISCONNECTED
    | zmq.EVENT_HANDSHAKE_SUCCEEDED
    | zmq.EVENT_HANDSHAKE_FAILED_AUTH
    | zmq.EVENT_HANDSHAKE_FAILED_PROTOCOL
    | zmq.EVENT_HANDSHAKE_FAILED_NO_DETAIL
)
HANDSHAKE_FAILED = (
    zmq.EVENT_HANDSHAKE_FAILED_AUTH
    | zmq.EVENT_HANDSHAKE_FAILED_PROTOCOL
    | zmq.EVENT_HANDSHAKE_FAILED_NO_DETAIL
)


@dataclass(frozen=True, slots=True)
class SocketEvent:
    """Something happened to a connection."""

    kind: int
    """One of zmq's EVENT_…"""
    value: int
    """A descriptor, an errno, a ZAP status or a protocol error, as the kind has it."""
    address: str
    """The listening or the dialled end."""


def watch(socket: zmq.Socket[bytes], on_event: Callable[[SocketEvent], None]) -> Drained:
    """Tell of a socket's connections until the result is closed (before the socket is)."""
    # Not pyzmq's own name, made of the descriptor: descriptors come back, names linger.
    address = f"inproc://nondum.monitor.{next(_numbers)}"
    socket.monitor(address, WATCHED)
    ears = socket.context.socket(zmq.PAIR)
    ears.linger = 0
    ears.connect(address)

    def on_frames(frames: list[zmq.Frame]) -> None:
        kind, value = _FORMAT.unpack(frames[0].bytes)
        on_event(SocketEvent(kind, value, frames[1].bytes.decode("ascii", "replace")))

    return Drained(ears, on_frames)

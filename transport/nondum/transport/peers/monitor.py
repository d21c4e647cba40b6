"""What ZeroMQ tells of a socket's connections, as values. Source: zmq_socket_monitor(3)."""

from __future__ import annotations

import contextlib
import itertools
import struct
from collections.abc import Callable

import zmq

from nondum.sdk.frozen import frozen
from nondum.transport.peers.drained import Drained

_FORMAT = struct.Struct("=HI")
_numbers = itertools.count(1)

WATCHED = (
    zmq.EVENT_ACCEPTED
    | zmq.EVENT_CONNECTED
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


@frozen
class SocketEvent:
    """Something happened to a connection."""

    kind: int
    """One of zmq's EVENT_…"""
    value: int
    """A descriptor, an errno, a ZAP status or a protocol error, as the kind has it."""
    address: str
    """The listening or the dialled end."""


class Watch:
    """Tells of a socket's connections. `close` it before the socket."""

    def __init__(self, socket: zmq.Socket[bytes], on_event: Callable[[SocketEvent], None]) -> None:
        """Raises `zmq.ZMQError` and `OSError` where there are no descriptors for it."""
        self._socket, self._on_event = socket, on_event
        # Not pyzmq's own name, made of the descriptor: descriptors come back, names linger.
        address = f"inproc://nondum.monitor.{next(_numbers)}"
        with contextlib.ExitStack() as taken:  # in the order in which `close` lets go of it
            monitor = socket.context.socket(zmq.PAIR)
            taken.callback(monitor.close, 0)
            monitor.linger = 0
            monitor.rcvhwm = 0  # else a hanging host makes ZeroMQ's thread wait until it reads
            socket.monitor(address, WATCHED)
            taken.callback(socket.disable_monitor)
            monitor.connect(address)
            self._monitor = Drained(monitor, self._on_frames)
            taken.pop_all()

    def close(self) -> None:
        """Stop the monitor before its socket closes, or ZeroMQ waits for ever to send the end."""
        if not self._monitor.is_closed:
            self._socket.disable_monitor()
            self._monitor.close()

    def _on_frames(self, frames: list[zmq.Frame]) -> None:
        kind, value = _FORMAT.unpack(frames[0].bytes)
        self._on_event(SocketEvent(kind, value, frames[1].bytes.decode("ascii", "replace")))

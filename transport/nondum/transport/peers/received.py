"""What came over one connection against what was delivered of it.

ZeroMQ bounds the length of a part and the number of messages that wait, but not the number of parts
of a message, and delivers none of it before its last part has come: a message that does not end
would fill this process's memory, and nothing would be told. The kernel knows how many bytes were
read from the connection.

On the wire a part has a header of 2 bytes, or of 9 from a length of 256 (RFC 23/ZMTP), and is a
CURVE MESSAGE command where links are secured: 33 bytes more (RFC 25/ZMTP-CURVE).
"""

from __future__ import annotations

from collections.abc import Iterable

import zmq

from nondum.transport.peers import tcp
from nondum.transport.peers.messages import MAX_MESSAGE

MOST_AHEAD = 4 * MAX_MESSAGE
"""Bytes that may have been read from a connection beyond the messages that were delivered: the
handshake, the part that is being read, and headroom."""
SEALED = 33
"""Bytes that CURVE adds to a part."""
_LONG = 256


class Received:
    """The account of one connection. What is no connection any more is never ahead."""

    def __init__(self, descriptor: int, *, is_sealed: bool) -> None:
        """Of a connection just made, or just heard of; `is_sealed` where CURVE secures it."""
        self.descriptor = descriptor
        self.end = tcp.other_end(descriptor)
        self._seal = SEALED if is_sealed else 0
        self._delivered = 0

    def delivered(self, parts: Iterable[zmq.Frame]) -> None:
        """A message came whole: all its parts, as they came over the connection."""
        for part in parts:
            self._delivered += on_wire(len(part) + self._seal)

    def read(self) -> int:
        """Bytes that were read from the connection until now."""
        state = tcp.state(self.descriptor, self.end) if self.end else None
        if state is None:
            return 0
        # Never more than came, or a peer could save up for a message that does not end.
        self._delivered = min(self._delivered, state.bytes_received)
        return state.bytes_read

    def ahead(self, read: int) -> int:
        """How many of `read` bytes belong to no message that was delivered."""
        return read - self._delivered

    def yield_to(self, other: Received) -> None:
        """Another connection has this descriptor now, and leads to the same end: it was another's
        when this account began, and is looked at no more."""
        if (self.descriptor, self.end) == (other.descriptor, other.end):
            self.end = ""


def on_wire(length: int) -> int:
    """Bytes that a part of this length takes on the wire.

    >>> on_wire(255), on_wire(256)
    (257, 265)
    """
    return length + (2 if length < _LONG else 9)

"""One end of the connection between the daemon and the process of its links."""

from __future__ import annotations

import socket
from collections.abc import Callable
from typing import Any

from nondum.sdk.errors import Problem, ProtocolViolation
from nondum.sdk.outbox import Outbox
from nondum.sdk.packets import Handle, SocketPackets
from nondum.sdk.wire import pack, unpack
from nondum.transport.peers.messages import MAX_MESSAGE

LONGEST = MAX_MESSAGE + 1024
"""Bytes of a packet: a message, and what is said with it."""
WINDOW = 64
"""Messages to one peer that may be between the daemon and ZeroMQ: at most 8 MiB."""
_BUFFER_BYTES = 4 * LONGEST
"""Asked for in the kernel, which gives what it will (socket(7), SO_SNDBUF)."""


def pipe_sockets() -> tuple[socket.socket, socket.socket]:
    """Make the two ends: the daemon's, and the other one, to be inherited."""
    ends = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    for end in ends:
        end.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _BUFFER_BYTES)
    return ends


class Pipe:
    """Packets in order, both ways; what the other end cannot take yet waits here. `close` it."""

    def __init__(
        self,
        sock: socket.socket,
        on_packet: Callable[[Any], None],
        on_closed: Callable[[ProtocolViolation | None], None],
        most_waiting: int,
        on_drained: Callable[[], None] = lambda: None,
    ) -> None:
        """Own `sock` and begin to read, on the running loop.

        `on_packet` may raise `ProtocolViolation`, which closes the pipe. `on_closed` is called once
        when the other end is gone (None) or broke the protocol, not after `close`; `on_drained`
        when nothing waits any more after the pipe was crowded, by more than `most_waiting` bytes.
        """
        self._on_packet, self._on_closed, self._on_drained = on_packet, on_closed, on_drained
        self._most_waiting = most_waiting
        self._was_crowded = False
        self._packets = SocketPackets(sock, LONGEST, max_handles=0)
        self._outbox = Outbox(self._packets, self._drained)
        self._packets.open(self._receive, on_closed)

    @property
    def is_crowded(self) -> bool:
        """Whether much waits for the other end."""
        return self._outbox.bytes > self._most_waiting

    def send(self, *fields: Any) -> None:
        """Send a packet, at once or later; to an end that is gone, not at all."""
        self._outbox.send(pack(fields, LONGEST))
        self._was_crowded |= self.is_crowded

    def close(self) -> None:
        """Let go of it; what waits is lost."""
        self._outbox.clear()
        self._packets.close()

    def _drained(self) -> None:
        if self._was_crowded:
            self._was_crowded = False
            self._on_drained()

    def _receive(self, data: bytes, _handles: tuple[Handle, ...]) -> None:
        try:
            self._on_packet(unpack(data, LONGEST))
        except ProtocolViolation as violated:
            self.close()
            self._on_closed(violated)


def violation() -> ProtocolViolation:
    """What is raised at a packet that has no place."""
    return ProtocolViolation(Problem("PACKET_KIND", "a packet has no place there"))

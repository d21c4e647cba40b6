"""One end of the connection between the daemon and the process of its links."""

from __future__ import annotations

import socket
from collections import deque
from collections.abc import Callable
from typing import Any

from nondum.sdk.errors import Problem, ProtocolViolation
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
        self._waiting: deque[bytes] = deque()
        self._waiting_bytes = 0
        self._was_crowded = False
        self._packets = SocketPackets(sock, LONGEST, max_handles=0)
        self._packets.open(self._receive, on_closed)

    @property
    def is_crowded(self) -> bool:
        """Whether much waits for the other end."""
        return self._waiting_bytes > self._most_waiting

    def send(self, *fields: Any) -> None:
        """Send a packet, at once or later; to an end that is gone, not at all."""
        data = pack(fields, LONGEST)
        if not self._waiting and self._packets.send(data):
            return
        self._waiting.append(data)
        self._waiting_bytes += len(data)
        self._was_crowded |= self.is_crowded
        if len(self._waiting) == 1:
            self._packets.when_writable(self._flush)

    def close(self) -> None:
        """Let go of it; what waits is lost."""
        self._waiting.clear()
        self._packets.close()

    def _flush(self) -> None:
        while self._waiting:
            if not self._packets.send(self._waiting[0]):
                self._packets.when_writable(self._flush)
                return
            self._waiting_bytes -= len(self._waiting.popleft())
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

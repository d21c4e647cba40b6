"""What the listening socket tells of those who connect: bounds them, and counts how they ended."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

import zmq

from nondum.transport.peers.accepted import AcceptedConnections
from nondum.transport.peers.monitor import SocketEvent
from nondum.transport.peers.refusals import Reason, Refusal

# From zmq.h: ZMQ_PROTOCOL_ERROR_ZMTP_CRYPTOGRAPHIC and …_MECHANISM_MISMATCH.
_OTHER_KEYS = frozenset({0x11000001, 0x11000002})


class Arrivals:
    """Connections to this host until they are a peer's."""

    def __init__(
        self,
        on_refusal: Callable[[Refusal], None],
        on_closed: Callable[[int], None],
        awake_s: Callable[[], float] | None = None,
    ) -> None:
        """`on_refusal` is told of all that became no peer's, `on_closed` the descriptor of every
        connection that ended; `awake_s` tells how long the loop has run: while it stands still, no
        one can show who it is."""
        self._on_refusal, self._on_closed = on_refusal, on_closed
        self._awake_s = awake_s or asyncio.get_running_loop().time
        self._connections = AcceptedConnections()
        self._explained = 0
        """Connections whose failure was told, and counted, but not yet their end."""

    @property
    def strangers(self) -> int:
        """Connections that are no peers yet."""
        return self._connections.strangers

    def on_event(self, event: SocketEvent) -> None:
        """Take in what the socket's monitor tells."""
        if event.kind == zmq.EVENT_ACCEPTED:
            for end in self._connections.opened(event.value, self._awake_s()):
                self._count(Reason.CROWDED, end)
        elif event.kind == zmq.EVENT_DISCONNECTED:
            if self._connections.closed(event.value):
                self._count_end()
            self._on_closed(event.value)
        elif event.kind == zmq.EVENT_HANDSHAKE_FAILED_PROTOCOL:
            self._explained += 1
            self._count(Reason.MISMATCH if event.value in _OTHER_KEYS else Reason.GARBAGE)
        elif event.kind == zmq.EVENT_HANDSHAKE_FAILED_AUTH:
            self._explained += 1  # the gate has counted it

    def spoke(self, descriptor: int) -> None:
        """The first message has come over a connection."""
        self._connections.spoke(descriptor, self._awake_s())

    def became_peer(self, descriptor: int) -> None:
        """A connection has shown who it is."""
        self._connections.became_peer(descriptor, self._awake_s())

    def cut_overdue(self) -> None:
        """Cut those that take too long or send too much."""
        for end in self._connections.cut_overdue(self._awake_s()):
            self._count(Reason.SILENT, end)

    def _count_end(self) -> None:
        """A connection ended that was no peer's: some end without a reason told."""
        if self._explained:
            self._explained -= 1
        else:
            self._count(Reason.GARBAGE)

    def _count(self, reason: Reason, end: str = "") -> None:
        now_s = asyncio.get_running_loop().time()
        self._on_refusal(Refusal(reason, end, "", f"no peer: {reason.value}", now_s))

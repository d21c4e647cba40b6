"""The connections that were accepted, by descriptor: those that become no peers are cut.

ZeroMQ has no call that ends one connection of a listening socket, so its TCP connection is shut
down beneath it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from nondum.transport.peers import tcp

AWAITED_S = 4.5
"""How long a connection may take to become a peer's: a little less than ZeroMQ's own handshake."""
MAX_STRANGERS = 256
"""Connections that are no peers yet; beyond that the oldest is cut."""
STRANGERS_BYTES = 64 * 1024
"""What a connection may send before it is a peer's. ZeroMQ bounds messages, but not their number of
parts: one that never ends would fill the memory before it is delivered."""


@dataclass(slots=True)
class Accepted:
    """One connection."""

    end: str
    """The other end as `tcp.written`; empty when the connection was gone before this was read."""
    since_s: float
    is_peer: bool = False
    has_spoken: bool = False
    """Whether a message came of it; what becomes of it is told then."""


class AcceptedConnections:
    """What was accepted and is not closed yet."""

    def __init__(self) -> None:
        self._known: dict[int, Accepted] = {}

    @property
    def strangers(self) -> int:
        """Connections that are no peers yet."""
        return sum(not one.is_peer for one in self._known.values())

    def opened(self, descriptor: int, now_s: float) -> Iterator[str]:
        """A connection was accepted; the ends of older ones that were cut for it."""
        end = tcp.other_end(descriptor)
        known = self._known.get(descriptor)
        if end and known is not None and known.end == end:
            return  # its first message was quicker than the news of it
        self._known[descriptor] = Accepted(end, now_s)
        while self.strangers > MAX_STRANGERS:
            oldest = next(d for d, one in self._known.items() if not one.is_peer)
            gone = self._known.pop(oldest)
            tcp.cut(oldest, gone.end)
            yield gone.end

    def spoke(self, descriptor: int, now_s: float) -> None:
        """The first message has come over the connection."""
        known = self._known.setdefault(descriptor, Accepted(tcp.other_end(descriptor), now_s))
        known.has_spoken = True

    def became_peer(self, descriptor: int, now_s: float) -> None:
        """The connection has shown who it is."""
        self._known[descriptor] = Accepted(tcp.other_end(descriptor), now_s, is_peer=True)

    def closed(self, descriptor: int) -> bool:
        """The connection is gone; whether it was a stranger's that has sent no message."""
        known = self._known.pop(descriptor, None)
        return known is not None and not known.is_peer and not known.has_spoken

    def cut_overdue(self, now_s: float) -> Iterator[str]:
        """Cut those that took too long or sent too much, and tell their ends."""
        for descriptor, one in list(self._known.items()):
            if one.is_peer:
                continue
            is_late = now_s - one.since_s > AWAITED_S
            state = tcp.state(descriptor, one.end)
            if is_late or (state is not None and state.bytes_received > STRANGERS_BYTES):
                del self._known[descriptor]
                tcp.cut(descriptor, one.end)
                yield one.end

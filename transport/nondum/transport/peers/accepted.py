"""The connections that were accepted, by descriptor: those that become no peers are cut.

ZeroMQ has no call that ends one connection of a listening socket, so its TCP connection is shut
down beneath it. A descriptor may have gone to another connection meanwhile: the address of the
other end tells.
"""

from __future__ import annotations

import os
import socket
import struct
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from typing import Any

AWAITED_S = 4.5
"""How long a connection may take to become a peer's: a little less than ZeroMQ's own handshake."""
MAX_STRANGERS = 256
"""Connections that are no peers yet; the oldest makes room."""
STRANGERS_BYTES = 64 * 1024
"""What a connection may send before it is a peer's. ZeroMQ bounds messages, but not their number of
parts: one that never ends would fill the memory before anybody sees it."""

# struct tcp_info of linux/tcp.h: 8 bytes of small fields, 24 u32, 3 u64, then bytes_received.
_TCP_INFO = struct.Struct("=128xQ")


@dataclass(slots=True)
class Accepted:
    """One connection."""

    end: str
    """The other end as `written`; empty when it was gone before anybody looked."""
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
        """A connection was accepted; ends of those that were cut to make room."""
        end = other_end(descriptor)
        known = self._known.get(descriptor)
        if end and known is not None and known.end == end:
            return  # its first message was quicker than the news of it
        self._known[descriptor] = Accepted(end, now_s)
        while self.strangers > MAX_STRANGERS:
            oldest = next(d for d, one in self._known.items() if not one.is_peer)
            gone = self._known.pop(oldest)
            cut(oldest, gone.end)
            yield gone.end

    def spoke(self, descriptor: int, now_s: float) -> None:
        """The first message has come over the connection."""
        known = self._known.setdefault(descriptor, Accepted(other_end(descriptor), now_s))
        known.has_spoken = True

    def became_peer(self, descriptor: int, now_s: float) -> None:
        """The connection has shown who it is."""
        self._known[descriptor] = Accepted(other_end(descriptor), now_s, is_peer=True)

    def closed(self, descriptor: int) -> bool:
        """The connection is gone; whether it was a stranger's of which nobody has told anything."""
        known = self._known.pop(descriptor, None)
        return known is not None and not known.is_peer and not known.has_spoken

    def cut_overdue(self, now_s: float) -> Iterator[str]:
        """Cut those that took too long or sent too much, and tell their ends."""
        for descriptor, one in list(self._known.items()):
            if one.is_peer:
                continue
            is_late = now_s - one.since_s > AWAITED_S
            if is_late or bytes_received(descriptor) > STRANGERS_BYTES:
                del self._known[descriptor]
                cut(descriptor, one.end)
                yield one.end


def other_end(descriptor: int) -> str:
    """The other end of a TCP connection; empty when there is none.

    ZeroMQ may have closed it by now, and the descriptor be another socket's of this process.
    """
    try:
        with closing(_duplicate(descriptor)) as connection:
            if connection.family not in (socket.AF_INET, socket.AF_INET6):
                return ""
            return written(connection.getpeername())
    except (OSError, ValueError):
        return ""


def written(end: tuple[Any, ...]) -> str:
    """An end of a TCP connection as ZeroMQ takes it, behind `tcp://`.

    >>> written(("::ffff:10.0.0.7", 50001, 0, 0)), written(("fe80::1", 50001, 0, 3))
    ('10.0.0.7:50001', '[fe80::1%3]:50001')
    """
    host, port, *more = end
    if "." in host:  # an IPv4 address, or one that is mapped into IPv6 (RFC 4291, 2.5.5.2)
        return f"{host.removeprefix('::ffff:')}:{port}"
    scope = more[1] if len(more) > 1 else 0
    return f"[{host}%{scope}]:{port}" if scope else f"[{host}]:{port}"


def bytes_received(descriptor: int) -> int:
    """What has come over a TCP connection; 0 where the system does not tell."""
    try:
        with closing(_duplicate(descriptor)) as connection:
            info = connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, _TCP_INFO.size)
            return int(_TCP_INFO.unpack(info)[0])
    except (OSError, struct.error):
        return 0


def cut(descriptor: int, end: str) -> None:
    """Shut a connection down, if the descriptor is still the one to that end."""
    try:
        with closing(_duplicate(descriptor)) as connection:
            if written(connection.getpeername()) == end:
                connection.shutdown(socket.SHUT_RDWR)
    except (OSError, ValueError):
        return  # it is gone by itself


def _duplicate(descriptor: int) -> socket.socket:
    copy = os.dup(descriptor)
    try:
        return socket.socket(fileno=copy)
    except OSError:  # it is no socket's any more
        os.close(copy)
        raise

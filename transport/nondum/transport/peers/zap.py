"""Who may connect, asked by ZeroMQ for every connection. Source: RFC 27/ZAP.

ZeroMQ fails open: without a handler, or for a socket without a domain, every key is let in. So the
sockets demand an answer (`ZAP_ENFORCE_DOMAIN`), and `listener` proves that one is asked for.
"""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Callable
from enum import Enum
from typing import TypeAlias

import zmq
from zmq.utils import z85

from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen
from nondum.transport.peers.drained import Drained
from nondum.transport.peers.failures import PeerRefused

ENDPOINT = "inproc://zeromq.zap.01"
DOMAIN = b"nondum-peers"

log = logging.getLogger(__name__)


class Entry(Enum):
    """The answer to a connection, with its ZAP status."""

    LET_IN = b"200"
    TURNED_AWAY = b"400"
    BROKEN = b"500"


@frozen
class ConnectionAttempt:
    """A connection that another process wants to make."""

    address: str
    """Where from: an IP address."""
    domain: bytes
    mechanism: str
    key: str
    """The CURVE key that the other end has proved to hold, in Z85; empty without CURVE."""


Judge: TypeAlias = Callable[[ConnectionAttempt], Entry]


def parse(frames: list[bytes]) -> ConnectionAttempt:
    """Read a request. Raises `ValueError` for one that ZeroMQ did not make."""
    version, _, domain, address, _, mechanism, *credentials = frames  # the fifth is our own id
    if version != b"1.0":
        raise ValueError(f"ZAP version {version!r}")
    key = ""
    if mechanism == b"CURVE":
        (raw,) = credentials
        key = z85.encode(raw).decode("ascii")
    return ConnectionAttempt(address.decode("ascii"), domain, mechanism.decode("ascii"), key)


class ZapHandler:
    """Answers for all sockets of one context. `close` it after them."""

    def __init__(self, context: zmq.Context[zmq.Socket[bytes]], judge: Judge) -> None:
        """Raises `PeerRefused` (ZAP_TAKEN) when the context has a handler already, `zmq.ZMQError`
        and `OSError` where there are no descriptors for it."""
        self._judge = judge
        self._probes: set[str] = set()
        with contextlib.ExitStack() as taken:
            socket = context.socket(zmq.REP)
            taken.callback(socket.close, 0)
            socket.linger = 0
            try:
                socket.bind(ENDPOINT)
            except zmq.ZMQError as error:
                raise PeerRefused(
                    Problem("ZAP_TAKEN", "another handler answers for this context's connections")
                ) from error
            self._replies = Drained(socket, self._answer)
            taken.pop_all()

    def expect_probe(self, key: str) -> None:
        """Turn away, once, the next connection under this key (or under none): the self-test's."""
        self._probes.add(key)

    def close(self) -> None:
        """Answer no more: no connection is let in then."""
        self._replies.close()

    def _answer(self, frames: list[zmq.Frame]) -> None:
        parts = [frame.bytes for frame in frames]
        number = parts[1] if len(parts) > 1 else b""
        key, entry = "", Entry.BROKEN
        try:
            attempt = parse(parts)
            key, entry = attempt.key, self._judged(attempt)
        except Exception:  # whatever it is, everybody behind it would wait for ever
            log.exception("a connection could not be judged")
        user = key.encode("ascii") if entry is Entry.LET_IN else b""
        self._replies.send([b"1.0", number, entry.value, entry.name.encode("ascii"), user, b""])

    def _judged(self, attempt: ConnectionAttempt) -> Entry:
        if attempt.key in self._probes:
            self._probes.discard(attempt.key)
            return Entry.TURNED_AWAY
        return self._judge(attempt)

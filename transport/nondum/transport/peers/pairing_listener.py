"""The socket for pairing requests, open while a host can be paired. It accepts every other key.

It has a separate ZeroMQ context: a context has one ZAP handler, and this one accepts strangers.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable

import zmq

from nondum.sdk.frozen import frozen
from nondum.transport.peers import tcp
from nondum.transport.peers.arrivals import Arrivals
from nondum.transport.peers.drained import Drained
from nondum.transport.peers.keys import HostKeys, PeerKey
from nondum.transport.peers.link import Link
from nondum.transport.peers.listener import Context, listening
from nondum.transport.peers.monitor import Watch
from nondum.transport.peers.pairing_messages import MAX_BYTES
from nondum.transport.peers.refusals import Reason, Refusal, Refusals
from nondum.transport.peers.routes import AcceptedRoute
from nondum.transport.peers.zap import DOMAIN, ConnectionAttempt, Entry, ZapHandler

MOST_SENT = 64 * 1024
"""Bytes that a whole try may take, the handshake included; three times what it needs. The signs of
life of a whole window, each some 40 bytes, are nearly all of that."""


@frozen
class Asker:
    """The sender of a message."""

    id: bytes
    """Of the connection."""
    proved: PeerKey
    descriptor: int


class PairingListener:
    """Listens while it is open. `close` it."""

    def __init__(
        self,
        context: Context,
        keys: HostKeys,
        address: str,
        on_data: Callable[[Asker, bytes], None],
        refusals: Refusals,
    ) -> None:
        """`address` as ZeroMQ binds it. Raises `PeerRefused` (ZAP_TAKEN), `zmq.ZMQError` and
        `OSError`: with nothing of the context left open, which would wait for that at its end."""
        self._own_key, self._on_data = keys.public, on_data
        self._refusals = refusals
        self._arrivals = Arrivals(refusals.add, lambda _: None)
        with contextlib.ExitStack() as taken:
            self._zap = ZapHandler(context, self._judge)
            taken.callback(self._zap.close)
            socket = listening(context, keys)
            taken.callback(socket.close, 0)
            socket.setsockopt(zmq.MAXMSGSIZE, MAX_BYTES)
            self._monitor = Watch(socket, self._arrivals.on_event)
            taken.callback(self._monitor.close)
            socket.bind(address)
            bound = socket.getsockopt(zmq.LAST_ENDPOINT)
            assert isinstance(bound, bytes)
            self.port = int(bound.rstrip(b"\0").rpartition(b":")[2])
            self._listener = Drained(socket, self._on_frames)
            taken.pop_all()

    def link(self, asker: Asker) -> Link:
        """A link to who has asked in earnest."""
        on_peer, proved = self._arrivals.became_peer, asker.proved
        route = AcceptedRoute(self._listener, asker.id, asker.descriptor, on_peer, proved)
        route.became_peer()
        now_s = asyncio.get_running_loop().time()
        return Link(route, asker.proved, now_s, dialled=False)

    def turn_away(self, asker: Asker, told: str) -> None:
        """Cut who sent what does not belong here, and count it."""
        end = tcp.other_end(asker.descriptor)
        now_s = asyncio.get_running_loop().time()
        self._refusals.add(Refusal(Reason.GARBAGE, end, asker.proved, told, now_s))
        tcp.cut(asker.descriptor, end)

    def cut_overdue(self) -> None:
        """Cut those that say nothing, or send too much."""
        self._arrivals.cut_overdue()

    def close(self, linger_ms: int) -> None:
        """Listen no more; what was said may leave for `linger_ms`."""
        self._monitor.close()
        self._listener.close(linger_ms)
        self._zap.close()

    def _judge(self, attempt: ConnectionAttempt) -> Entry:
        is_let_in = (
            attempt.domain == DOMAIN
            and attempt.mechanism == "CURVE"
            and attempt.key != self._own_key
        )
        return Entry.LET_IN if is_let_in else Entry.TURNED_AWAY

    def _on_frames(self, frames: list[zmq.Frame]) -> None:
        data = frames[-1]
        proved = PeerKey(str(data.get("User-Id")))
        asker = Asker(frames[0].bytes, proved, int(data.get(zmq.SRCFD)))
        if len(frames) == 2:
            self._on_data(asker, data.bytes)
        else:
            self.turn_away(asker, "a message has one part")

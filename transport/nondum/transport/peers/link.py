"""One connection to a peer, dialled or accepted, from the first message to the end of it."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol

from nondum.sdk.errors import Problem
from nondum.transport.peers.drained import Sent
from nondum.transport.peers.keys import PeerKey
from nondum.transport.peers.messages import Message, encode
from nondum.transport.peers.suspicion import Watched

if TYPE_CHECKING:
    from nondum.transport.peers.session import Session

LINGER_MS = 200
"""How long the last words over a link may take."""


class Route(Protocol):
    """How a link's messages leave, and how it is ended."""

    @property
    def address(self) -> str:
        """The other end."""

    def send(self, data: bytes) -> Sent:
        """Send without waiting. When it is `GONE`, what came before may wait for `drain`."""

    def drain(self) -> bool:
        """Take in what has come, of other connections to the same socket, too; whether nothing is
        left that waits. Handlers run before it returns, so it is not called from one."""

    def cut(self, linger_ms: int = 0) -> None:
        """End the connection."""


class Link:
    """A route, who is proved to be at its end, and when that end was last heard."""

    def __init__(
        self, route: Route, proved: PeerKey | None, now_s: float, *, dialled: bool
    ) -> None:
        self.route, self.proved, self.dialled = route, proved, dialled
        self.heard_s = now_s
        self.beat_s = 0.0
        """Between two of the other end's pings, as the last one said."""
        self.watched = Watched(0.0)
        """Set when the link becomes a peer's."""
        self.calm_until_s = 0.0
        """There is nothing to look at before, in the same time as `watched`."""
        self.looking: asyncio.TimerHandle | None = None
        """When it is looked at next, if that is soon."""
        self.version = 1
        """Of the protocol, as agreed."""
        self.due_s = now_s
        """When this host is to ping next."""
        self.doubt_s = math.inf
        """How long this host may be silent without the other end giving the link up."""
        self._sent_s = now_s
        self._was_silent = False
        self._resumed_s = now_s
        """When this host last sent something after it had been silent for too long."""
        self._loop = asyncio.get_running_loop()
        self.session: Session | None = None
        """The peer's, once greetings were exchanged."""
        self.is_over = False
        self.on_refused: Callable[[Problem], None] | None = None
        """Told why, when a link that this host began is turned away."""
        self.on_peer: Callable[[], None] | None = None
        """Told when an accepted link becomes a peer's."""
        self.round_trip_s: float | None = None
        self._pinged = 0
        self._pinged_s = now_s

    def send(self, data: bytes) -> Sent:
        """Send without waiting."""
        if self.is_over:
            return Sent.GONE
        now_s = self._loop.time()  # before it is sent: this host may stand still from then on
        sent = self.route.send(data)
        self.note_sent(sent, now_s)
        return sent

    def note_sent(self, sent: Sent, now_s: float) -> None:
        """Note that this host spoke to the other end, by whatever way."""
        if self._is_silent(now_s):
            self._was_silent, self._resumed_s = True, now_s
        if sent is Sent.SENT:
            self._sent_s = now_s

    def is_doubtful(self, now_s: float) -> bool:
        """Whether the other end may have given the link up, since this host was silent."""
        return self._was_silent or self._is_silent(now_s)

    def confirm(self, since_s: float) -> bool:
        """The other end had not given it up at `since_s`, or later; whether that is enough: not if
        this host was silent again since."""
        if self._resumed_s > since_s or self._is_silent(self._loop.time()):
            return False
        self._was_silent = False
        return True

    def _is_silent(self, now_s: float) -> bool:
        return now_s - self._sent_s > self.doubt_s

    def tell(self, message: Message) -> Sent:
        """Send what may be lost."""
        return self.send(encode(message))

    def ping(self, number: int, data: bytes, now_s: float) -> Sent:
        """Give a sign of life: the message of a ping, and its number."""
        self._pinged, self._pinged_s = number, now_s
        return self.send(data)

    def pong_received(self, number: int, now_s: float) -> None:
        """A ping was answered."""
        if number == self._pinged:
            self.round_trip_s = now_s - self._pinged_s

    def cut(self, linger_ms: int = 0) -> None:
        """End it; once."""
        if not self.is_over:
            self.is_over = True
            self.route.cut(linger_ms)

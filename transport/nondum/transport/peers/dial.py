"""The standing wish to be linked to one peer: all its addresses at once, the first one wins.

Link-local addresses are tried a moment later.
Every connection has a separate socket. (ZeroMQ's reconnecting sends what was queued for the
connection before, retries a wrong key for ever, and a refused one never again.)
"""

from __future__ import annotations

import asyncio
import random
from collections.abc import Callable, Sequence
from typing import TypeAlias

from nondum.sdk.errors import Problem
from nondum.transport.peers.drained import Sent
from nondum.transport.peers.events import DialFailed
from nondum.transport.peers.failures import PeerRefused
from nondum.transport.peers.keys import PeerKey
from nondum.transport.peers.link import Link, Route
from nondum.transport.peers.refusals import Reason
from nondum.transport.peers.sockets import Receiver

HEAD_START_S = 0.05
"""What addresses of the link alone come behind the others: a link by one of them would break
whenever the cable is out for a moment."""
FIRST_WAIT_S = 0.05
LONGEST_WAIT_S = 5.0
ANSWER_S = 8.0
"""How long one attempt may take to be authenticated …"""
GREETING_S = 12.0
"""… and so much more to be greeted: the other end's loop has let it in, so it is only slow."""

Connect: TypeAlias = Callable[[PeerKey, str, Receiver], Route]
"""Begins one connection to an address. Raises `PeerRefused` (ADDRESS_MALFORMED,
DIAL_IMPOSSIBLE)."""


class Attempt:
    """One connection to one address, which may become a link: the route of that link."""

    def __init__(self, dial: Dial, connect: Connect, address: str) -> None:
        self.dial, self.address = dial, address
        self.is_connected = False
        self.is_settled = False
        """Whether it became a peer's link."""
        self.link: Link | None = None
        """Once it is authenticated."""
        self.route = connect(dial.key, address, self)

    def send(self, data: bytes) -> Sent:
        """Send without waiting."""
        return self.route.send(data)

    def drain(self) -> bool:
        """Take in what has come; whether nothing is left that waits."""
        return self.route.drain()

    def cut(self, linger_ms: int = 0) -> None:
        """End it, and have the dial try again."""
        self.route.cut(linger_ms)
        self.dial.over(self, None)

    def drop(self) -> None:
        """End it without a word."""
        self.route.cut()

    def connected(self) -> None:
        """The other end has proved its key."""
        self.is_connected = True
        self.dial.won(self)

    def received(self, data: bytes) -> None:
        """A message came."""
        if self.link is not None:
            self.dial.on_data(self.link, data)

    def misused(self, reason: Reason) -> None:
        """What came is no message of a host's."""
        if self.link is not None:
            self.dial.on_misused(self.link, reason)

    def doubtful(self) -> None:
        """Not told of dialled ones: their end is."""

    def over(self, problem: Problem | None) -> None:
        """It has failed, or its connection broke."""
        self.dial.over(self, problem)


class Dial:
    """Tries, waits, and tries again, until it is closed."""

    def __init__(
        self,
        key: PeerKey,
        addresses: Sequence[str],
        *,
        connect: Connect,
        is_wanted: Callable[[PeerKey], bool],
        on_won: Callable[[Attempt], None],
        on_over: Callable[[Attempt], None],
        on_data: Callable[[Link, bytes], None],
        on_misused: Callable[[Link, Reason], None],
        on_event: Callable[[DialFailed], None],
    ) -> None:
        """`is_wanted` is false while there is another link already.

        `on_won` is told of an authenticated connection, `on_over` of its end; `on_data` and
        `on_misused` of what came over one that has a link.
        """
        self.key, self.addresses = key, tuple(addresses)
        self.on_data, self.on_misused = on_data, on_misused
        self._connect, self._is_wanted = connect, is_wanted
        self._on_won, self._on_over, self._on_event = on_won, on_over, on_event
        self._loop = asyncio.get_running_loop()
        self._attempts: list[Attempt] = []
        self._told: dict[str, str] = {}
        self._wait_s = FIRST_WAIT_S
        self._retry: asyncio.TimerHandle | None = None
        self._limit: asyncio.TimerHandle | None = None
        self._others: asyncio.TimerHandle | None = None
        self._is_closed = False
        self._try()

    @property
    def links(self) -> tuple[Link, ...]:
        """Of connections that are authenticated."""
        return tuple(one.link for one in self._attempts if one.link is not None)

    def settled(self) -> None:
        """The link is a peer's: the next break is met at once."""
        self._wait_s = FIRST_WAIT_S
        self._told.clear()
        for attempt in self._attempts:
            attempt.is_settled = attempt.is_connected

    def again(self) -> None:
        """There is no link to the peer any more: try soon."""
        if self._is_closed or self._attempts or self._retry is not None:
            return
        wait_s = self._wait_s * random.uniform(0.5, 1.0)  # or two hosts may keep in step
        self._wait_s = min(self._wait_s * 2, LONGEST_WAIT_S)
        self._retry = self._loop.call_later(wait_s, self._try)

    def won(self, attempt: Attempt) -> None:
        """A connection is authenticated: the others are not needed."""
        for other in self._attempts:
            if other is not attempt:
                other.drop()
        self._attempts = [attempt]
        self._on_won(attempt)

    def over(self, attempt: Attempt, problem: Problem | None) -> None:
        """An attempt has failed, or its connection broke."""
        if attempt not in self._attempts:
            return
        self._attempts.remove(attempt)
        attempt.drop()
        if problem is not None and not attempt.is_settled:
            self._tell(attempt.address, problem)
        self._on_over(attempt)
        self.again()

    def close(self) -> None:
        """Try no more. A connection that became a link lasts until it breaks."""
        self._is_closed = True
        for timer in (self._retry, self._limit, self._others):
            if timer is not None:
                timer.cancel()
        for attempt in self._attempts:
            if not attempt.is_settled:
                attempt.drop()
        self._attempts = [one for one in self._attempts if one.is_settled]

    def _tell(self, address: str, problem: Problem) -> None:
        if self._told.get(address) != problem.code:
            self._told[address] = problem.code
            self._on_event(DialFailed(self.key, address, problem))

    def _try(self) -> None:
        self._retry = None
        if not self._is_wanted(self.key):
            return
        lasting = tuple(one for one in self.addresses if not is_of_link(one))
        self._attempt(lasting or self.addresses)
        if lasting and self._others is None:
            others = tuple(one for one in self.addresses if one not in lasting)
            self._others = self._loop.call_later(HEAD_START_S, self._try_link_local, others)
        if self._limit is not None:
            self._limit.cancel()
        self._limit = self._loop.call_later(ANSWER_S, self._give_up)
        self.again()

    def _try_link_local(self, addresses: Sequence[str]) -> None:
        self._others = None
        if self._is_wanted(self.key) and not any(one.is_connected for one in self._attempts):
            self._attempt(addresses)

    def _attempt(self, addresses: Sequence[str]) -> None:
        for address in addresses:
            try:
                self._attempts.append(Attempt(self, self._connect, address))
            except PeerRefused as unusable:
                self._tell(address, unusable.problems[0])

    def _give_up(self) -> None:
        if any(one.is_connected and not one.is_settled for one in self._attempts):
            self._limit = self._loop.call_later(GREETING_S, self._give_up_greeting)
        for attempt in list(self._attempts):
            if not attempt.is_connected:
                self.over(attempt, Problem("PEER_SILENT", "no host answers there"))

    def _give_up_greeting(self) -> None:
        for attempt in list(self._attempts):
            if not attempt.is_settled:
                self.over(attempt, Problem("PEER_SILENT", "no host answers there"))


def is_of_link(address: str) -> bool:
    """Whether an address is gone whenever its link is down, if only for a moment (RFC 4862).

    >>> is_of_link("tcp://[fe80::1%eth0]:7410"), is_of_link("tcp://10.0.0.7:7410")
    (True, False)
    """
    return address.startswith("tcp://[fe80:")

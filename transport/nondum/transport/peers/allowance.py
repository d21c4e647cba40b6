"""The rate limit for messages that a peer sends unasked.

It is far more than any host needs, and too little to keep this host from its work.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar

from nondum.sdk.frozen import frozen
from nondum.transport.link.token_bucket import TokenBucket

LENGTH = 16 * 1024
"""Bytes after which a message counts as one more."""
WAITING = 4096
"""Messages that may wait until they are allowed: more than all calls that a peer may have begun."""
LOOK_S = 0.01
"""Between two looks at what waits."""
GREETINGS_PER_S, GREETINGS = 3.0, 60.0
"""A link that breaks again and again is no flood; this is."""
BARRED_S = 30.0
"""How long a peer is not let in that has flooded this host."""

T = TypeVar("T")


@frozen
class Allowance:
    """Messages that no call of this host has asked for. Answers to calls are free."""

    per_s: float = 4000.0
    burst: float = 20_000.0

    def bucket(self) -> TokenBucket:
        """A full one, for one peer."""
        return TokenBucket(self.per_s, self.burst, 0.0)


USUAL = Allowance()


def greetings() -> TokenBucket:
    """How often one peer may greet."""
    return TokenBucket(GREETINGS_PER_S, GREETINGS, 0.0)


def cost(length: int) -> int:
    """How many messages one of `length` bytes counts as.

    >>> cost(100), cost(128 * 1024)
    (1, 9)
    """
    return 1 + length // LENGTH


class Paced(Generic[T]):
    """Passes on what a peer sends, in order, and no faster than it is allowed to send.

    That slows down a peer that waits for answers, so it never has too much waiting.
    """

    def __init__(self, bucket: TokenBucket, hand_on: Callable[[T], None]) -> None:
        self._bucket, self._hand_on = bucket, hand_on
        self._loop = asyncio.get_running_loop()
        self._waiting: deque[tuple[int, T]] = deque()
        self._size = 0
        self._timer: asyncio.TimerHandle | None = None
        self._is_held = False

    def take(self, one: T, cost: int, *, passes_held: bool = False) -> bool:
        """Hand it on, now or later; False when too much waits already.

        `passes_held`: it does not wait behind what is held, if the peer may send as much.
        """
        may_pass = passes_held if self._is_held else not self._waiting
        if may_pass and self._bucket.take(cost, self._loop.time()):
            self._hand_on(one)
            return True
        if self._size + cost > WAITING:
            return False
        self._waiting.append((cost, one))
        self._size += cost
        if self._timer is None and not self._is_held:
            self._timer = self._loop.call_later(LOOK_S, self._look)
        return True

    def hold(self) -> None:
        """Hand nothing on until `release`."""
        self._is_held = True
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def release(self) -> None:
        """Hand on what was held."""
        self._is_held = False
        if self._timer is None:
            self._look()

    def close(self) -> None:
        """Forget what waits."""
        self._waiting.clear()
        if self._timer is not None:
            self._timer.cancel()

    def _look(self) -> None:
        while self._waiting and self._bucket.take(self._waiting[0][0], self._loop.time()):
            cost, one = self._waiting.popleft()
            self._size -= cost
            self._hand_on(one)
        again = bool(self._waiting)
        self._timer = self._loop.call_later(LOOK_S, self._look) if again else None

"""A queue that lets a few callers in at a time, in order, and tells each its place in the queue."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable

TellAhead = Callable[[int], None]
"""How many are before one that begins to wait; 0 when its turn has come."""


class Queue:
    """Lets `at_once` in at a time, by name."""

    def __init__(self, at_once: int) -> None:
        self._free = asyncio.Semaphore(at_once)
        self._inside: set[str] = set()
        self._waiting = 0

    async def enter(self, name: str, tell: TellAhead) -> None:
        """Wait for a turn; a caller that has one keeps it. `leave` ends it."""
        if name in self._inside:
            return
        waits = self._free.locked()
        if waits:
            tell(self._waiting + len(self._inside))
        self._waiting += 1
        try:
            await self._free.acquire()
        finally:
            self._waiting -= 1
        self._inside.add(name)
        if waits:
            tell(0)

    def leave(self, name: str) -> None:
        """End a turn, and let the next caller in; does nothing for a caller that has no turn."""
        if name in self._inside:
            self._inside.discard(name)
            self._free.release()

    @contextlib.asynccontextmanager
    async def turn(self, name: str, tell: TellAhead) -> AsyncIterator[None]:
        """A turn for as long as the context lasts."""
        await self.enter(name, tell)
        try:
            yield
        finally:
            self.leave(name)

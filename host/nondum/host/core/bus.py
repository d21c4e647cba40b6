"""The event bus: takes events from all emitters to the manager and to all listeners."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Container, Sequence

from nondum.host.core.clock import now
from nondum.host.core.events.event import Emit, Event
from nondum.host.core.records.moment import Moment

Stamped = tuple[Event, Moment]

log = logging.getLogger(__name__)


class Bus:
    """Takes events in; passes them to the manager in order, and to listeners."""

    def __init__(self, decided: Container[type[Event]], clock: Callable[[], Moment] = now) -> None:
        """`decided` are the kinds of events that the manager decides something from."""
        self.clock = clock
        self._decided = decided
        self._queue: asyncio.Queue[Stamped] = asyncio.Queue()
        self._listeners: list[Emit] = []
        self.taken = 0
        """Events that were taken in for the manager."""
        self._given = 0
        self.followed = 0
        """Of those, how many it is through with: it has come back for more."""

    def emit(self, event: Event) -> None:
        """Take an event in. Call it on the loop's thread; it never blocks."""
        if self.is_told_early(event):
            self.tell((event,))
        if event.JOURNALLED or type(event) in self._decided:
            self._queue.put_nowait((event, self.clock()))
            self.taken += 1

    def subscribe(self, listener: Emit) -> Callable[[], None]:
        """Have every event told to `listener`, on the loop's thread; returns how to end that.

        What changes the catalogue is told when it has been committed, everything else at once.
        """
        self._listeners.append(listener)
        return lambda: self._listeners.remove(listener)

    async def batch(self) -> list[Stamped]:
        """Wait for events; return all that are queued. The caller has handled those before."""
        self.followed = self._given
        batch = [await self._queue.get()]
        while not self._queue.empty():
            batch.append(self._queue.get_nowait())
        self._given += len(batch)
        return batch

    def tell(self, events: Sequence[Event]) -> None:
        """Tell listeners what has happened. An error of one does not affect the others."""
        for event in events:
            for listener in tuple(self._listeners):
                try:
                    listener(event)
                except Exception:
                    log.exception("a listener raised an error at %s", event.name)

    def is_told_early(self, event: Event) -> bool:
        """Whether listeners hear of an event before (or without) its being journalled."""
        return type(event) not in self._decided

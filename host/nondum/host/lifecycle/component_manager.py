"""The component manager's loop: an event in, the new state committed, its effects set going.

Nothing is done before the journal tells of it; an executor reports what it did as events again.
"""

from __future__ import annotations

import asyncio
import logging
import sqlite3
from collections.abc import Callable, Sequence
from typing import Protocol

from nondum.host.catalogue.catalogue import Catalogue, now
from nondum.host.catalogue.records import JournalEntry, Moment, Snapshot
from nondum.host.catalogue.state import HostState
from nondum.host.drives.source import DriveSource
from nondum.host.effects import Effect
from nondum.host.events import DrivesScanned, Emit, Event
from nondum.host.lifecycle.advance import RULES, advance
from nondum.host.lifecycle.recovery import recover
from nondum.host.lifecycle.telling import entries_of
from nondum.host.lifecycle.turn import Outcome

COMMIT_AGAIN_S = 0.5
"""After a commit failed (a full disk, say)."""

log = logging.getLogger(__name__)


class Carries(Protocol):
    """Whoever carries effects out and reports by events."""

    def start(self, effect: Effect) -> None:
        """Set an effect going; never blocks, never raises."""
        ...

    async def prepare(self, state: HostState) -> None:
        """Delete what a recovered state does not account for, before anything is started."""
        ...

    async def close(self) -> None:
        """Stop everything that runs."""
        ...


class ComponentManager:
    """Owns the state of a host from start to stop."""

    def __init__(
        self, catalogue: Catalogue, executor: Carries, *, clock: Callable[[], Moment] = now
    ) -> None:
        self._catalogue = catalogue
        self._executor = executor
        self._clock = clock
        self._queue: asyncio.Queue[tuple[Event, Moment]] = asyncio.Queue()
        self._listeners: list[Emit] = []
        self._sources: list[DriveSource] = []
        self._tasks: list[asyncio.Task[None]] = []

    def add_source(self, source: DriveSource) -> None:
        """Watch one more source of drives; call it before `run`."""
        self._sources.append(source)

    def subscribe(self, listener: Emit) -> Callable[[], None]:
        """Have every event told to `listener`, on the loop's thread; returns how to end that.

        What changes the catalogue is told when it is committed, everything else at once.
        """
        self._listeners.append(listener)
        return lambda: self._listeners.remove(listener)

    def emit(self, event: Event) -> None:
        """Take an event in. Call it on the loop's thread."""
        if type(event) not in RULES:
            self._tell((event,))
            if not event.JOURNALLED:
                return
        self._queue.put_nowait((event, self._clock()))

    def snapshot(self) -> Snapshot:
        """The catalogue as last committed."""
        return self._catalogue.snapshot()

    async def run(self) -> None:
        """Recover what the last daemon left, then follow events until cancelled."""
        try:
            await self._start()
            while True:
                await self._follow(await self._batch())
        finally:
            for task in self._tasks:
                task.cancel()
            await asyncio.gather(*self._tasks, return_exceptions=True)
            await self._executor.close()

    async def _start(self) -> None:
        recovered = recover(self._catalogue.state, self._clock())
        await self._executor.prepare(recovered.state)
        await self._commit(recovered, [(event, self._clock()) for event in recovered.events])
        self._carry_out(recovered, recovered.events)
        for source in self._sources:
            self._tasks.append(asyncio.create_task(source.watch(self.emit)))
        watched = {source.kind for source in self._sources}
        for kind in {drive.kind for drive in recovered.state.drives.values()} - watched:
            if kind != "installed":
                self.emit(DrivesScanned(kind, ()))

    async def _batch(self) -> list[tuple[Event, Moment]]:
        """All events that wait: they share one commit."""
        batch = [await self._queue.get()]
        while not self._queue.empty():
            batch.append(self._queue.get_nowait())
        return batch

    async def _follow(self, batch: Sequence[tuple[Event, Moment]]) -> None:
        state = self._catalogue.state
        effects: list[Effect] = []
        told: list[tuple[Event, Moment]] = []
        for event, at in batch:
            outcome = advance(state, event, at)
            state = outcome.state
            effects.extend(outcome.effects)
            told.extend((followed, at) for followed in outcome.events)
        outcome = Outcome(state, tuple(effects), tuple(event for event, _ in told))
        await self._commit(outcome, told)
        early = {id(event) for event, _ in batch if type(event) not in RULES}
        self._carry_out(outcome, [event for event in outcome.events if id(event) not in early])

    async def _commit(self, outcome: Outcome, told: Sequence[tuple[Event, Moment]]) -> None:
        if outcome.state is self._catalogue.state and not told:
            return
        entries = self._entries(outcome.state, told)
        while True:
            try:
                await self._catalogue.commit(outcome.state, entries)
                return
            except sqlite3.OperationalError:
                log.exception("the catalogue cannot be written; trying again")
                await asyncio.sleep(COMMIT_AGAIN_S)

    def _entries(
        self, after: HostState, told: Sequence[tuple[Event, Moment]]
    ) -> list[JournalEntry]:
        before, boot = self._catalogue.state, self._catalogue.boot
        return list(entries_of(told, before, after, boot))

    def _carry_out(self, outcome: Outcome, told: Sequence[Event]) -> None:
        self._tell(told)
        for effect in outcome.effects:
            self._executor.start(effect)

    def _tell(self, events: Sequence[Event]) -> None:
        for event in events:
            for listener in tuple(self._listeners):
                listener(event)

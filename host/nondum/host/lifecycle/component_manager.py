"""The component manager's loop: an event in, the new state committed, its effects set going.

Nothing is done before the journal tells of it; an executor reports what it did as events again.
"""

from __future__ import annotations

import asyncio
import logging
import sqlite3
from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

from nondum.host.catalogue.catalogue import Catalogue
from nondum.host.catalogue.records import Snapshot
from nondum.host.catalogue.state import HostState
from nondum.host.drives.source import DriveSource
from nondum.host.effects import Effect
from nondum.host.events import CatalogueSetAside, DrivesScanned
from nondum.host.lifecycle.advance import advance
from nondum.host.lifecycle.bus import Bus, Stamped, is_told_early
from nondum.host.lifecycle.recovery import recover
from nondum.host.lifecycle.telling import entries_of
from nondum.host.lifecycle.turn import Outcome
from nondum.sdk.errors import Problem

COMMIT_AGAIN_S = 0.5
"""After a commit failed: on a full disk, say."""

INSTALLED = "installed"
"""Kind of the drives that stand for initial components: no source watches them."""

log = logging.getLogger(__name__)


class Executes(Protocol):
    """Whoever carries effects out and reports by events."""

    async def prepare(self, state: HostState) -> None:
        """Clear away what a recovered state does not account for, before anything is started."""
        ...

    def start(self, effect: Effect) -> None:
        """Set an effect going; never blocks, never raises."""
        ...

    async def close(self) -> None:
        """Stop everything that runs."""
        ...


class ComponentManager:
    """Owns the state of a host from start to stop."""

    def __init__(self, catalogue: Catalogue, executor: Executes, bus: Bus) -> None:
        self._catalogue = catalogue
        self._executor = executor
        self._bus = bus
        self._sources: list[DriveSource] = []

    def add_source(self, source: DriveSource) -> None:
        """Watch one more source of drives; call it before `run`."""
        self._sources.append(source)

    def snapshot(self) -> Snapshot:
        """The catalogue as last committed."""
        return self._catalogue.snapshot()

    async def run(self) -> None:
        """Recover what the last daemon left, then follow events until cancelled.

        Raises what a source of drives raises. The executor is closed at the end, the catalogue is
        not.
        """
        try:
            await self._start()
            async with asyncio.TaskGroup() as tasks:
                for source in self._sources:
                    tasks.create_task(source.watch(self._bus.emit))
                tasks.create_task(self._follow_all())
        finally:
            await self._executor.close()

    async def _start(self) -> None:
        recovered = recover(self._catalogue.state, self._bus.clock())
        await self._executor.prepare(recovered.state)
        at = self._bus.clock()
        await self._commit(recovered.state, [(event, at) for event in recovered.events])
        self._bus.tell(recovered.events)
        for effect in recovered.effects:
            self._executor.start(effect)
        if (aside := self._catalogue.set_aside) is not None:
            self._bus.emit(CatalogueSetAside(recovered.state.host, (_set_aside(aside),)))
        watched = {INSTALLED, *(source.kind for source in self._sources)}
        for kind in {drive.kind for drive in recovered.state.drives.values()} - watched:
            self._bus.emit(DrivesScanned(kind, ()))

    async def _follow_all(self) -> None:
        while True:
            await self._follow(await self._bus.batch())

    async def _follow(self, batch: Sequence[Stamped]) -> None:
        """Events that waited together share one commit."""
        outcome, told = _advance_all(self._catalogue.state, batch)
        await self._commit(outcome.state, told)
        early = {id(event) for event, _ in batch if is_told_early(event)}
        self._bus.tell([event for event in outcome.events if id(event) not in early])
        for effect in outcome.effects:
            self._executor.start(effect)

    async def _commit(self, after: HostState, told: Sequence[Stamped]) -> None:
        before = self._catalogue.state
        if after is before and not told:
            return
        entries = list(entries_of(told, before, after, self._catalogue.boot))
        while True:
            try:
                await self._catalogue.commit(after, entries)
                return
            except sqlite3.OperationalError:
                log.exception("the catalogue cannot be written; trying again")
                await asyncio.sleep(COMMIT_AGAIN_S)


def _set_aside(file: Path) -> Problem:
    return Problem(
        "CATALOGUE_REBUILT",
        "the catalogue was damaged; drives are read anew, what was installed for good is not here",
        where=str(file),
        fix="install initial components again",
    )


def _advance_all(state: HostState, batch: Sequence[Stamped]) -> tuple[Outcome, list[Stamped]]:
    effects: list[Effect] = []
    stamped: list[Stamped] = []
    for event, at in batch:
        outcome = advance(state, event, at)
        state = outcome.state
        effects.extend(outcome.effects)
        stamped.extend((followed, at) for followed in outcome.events)
    events = tuple(event for event, _ in stamped)
    return Outcome(state, tuple(effects), events), stamped

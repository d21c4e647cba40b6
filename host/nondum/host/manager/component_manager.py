"""The component manager's loop: an event in, the new state committed, its effects set going.

Nothing is done before the journal tells of it; an executor reports what it did as events again.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import sqlite3
from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

from nondum.host.catalogue import opening
from nondum.host.catalogue.catalogue import Catalogue
from nondum.host.core.bus import Bus, Stamped
from nondum.host.core.effects import Effect
from nondum.host.core.events.catalogue import (
    CatalogueSetAside,
    CatalogueUnwritten,
    CatalogueWritten,
)
from nondum.host.core.events.daemon import HostStable, HostStopped
from nondum.host.core.events.drives import DrivesScanned
from nondum.host.core.journal_entry import entries_of
from nondum.host.core.records.drive import INSTALLED
from nondum.host.core.records.moment import Moment
from nondum.host.core.records.safety import Safety
from nondum.host.core.records.snapshot import Snapshot
from nondum.host.core.state import HostState
from nondum.host.core.transitions import HELD
from nondum.host.lifecycle.advance import advance
from nondum.host.lifecycle.crash_attribution import STEADY_S
from nondum.host.lifecycle.rebuilding import noting_all
from nondum.host.lifecycle.recovery import recover
from nondum.host.lifecycle.turn import Outcome
from nondum.host.sources.drives.source import DriveSource

COMMIT_AGAIN_S = 0.5
"""After a commit failed: on a full disk, say."""
COMMIT_TRIES = 1
"""Further attempts, before the host goes on with what cannot be written down."""

log = logging.getLogger(__name__)


class Executes(Protocol):
    """Carries effects out and reports by events."""

    async def rebuild(self, state: HostState, at: Moment) -> HostState:
        """The state, with what is installed for good and is not in it: its catalogue was lost."""
        ...

    async def missing(self, state: HostState) -> frozenset[str]:
        """Keys of payloads of the state whose files are gone."""
        ...

    async def prepare(self, state: HostState) -> None:
        """Clear away what a recovered state does not account for, before anything is started."""
        ...

    def adopt(self, state: HostState) -> None:
        """Note what was committed, before listeners are told; never blocks, never raises."""
        ...

    def start(self, effect: Effect) -> None:
        """Set an effect going; never blocks, never raises."""
        ...

    async def close(self) -> None:
        """Stop everything that runs."""
        ...


class ComponentManager:
    """Owns the state of a host from start to stop."""

    def __init__(
        self, catalogue: Catalogue, executor: Executes, bus: Bus, *, steady_s: float = STEADY_S
    ) -> None:
        self._catalogue = catalogue
        self._executor = executor
        self._bus = bus
        self._sources: list[DriveSource] = []
        self._unscanned: set[str] = set()
        """Kinds of drives of which it is not known yet what is plugged in."""
        self._trial: asyncio.TimerHandle | None = None
        self._steady_s = steady_s
        self._safety, self._why_safe = Safety.OFF, ""

    def add_source(self, source: DriveSource) -> None:
        """Watch one more source of drives; call it before `run`."""
        self._sources.append(source)

    def leave_alone(self, safety: Safety, why: str) -> None:
        """Run in safe mode; call it before `run`."""
        self._safety, self._why_safe = safety, why

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
        except asyncio.CancelledError:
            await self._stop()
            raise
        finally:
            if self._trial is not None:
                self._trial.cancel()
            await self._executor.close()

    async def _start(self) -> None:
        """The recovered state is committed first: who dies of what follows is counted by it."""
        self._unscanned = {source.kind for source in self._sources}
        state, at = self._catalogue.state, self._bus.clock()
        if self._catalogue.loss is not None:
            rebuilt = await self._executor.rebuild(state, at)
            self._tell_loss(state, rebuilt)
            state = rebuilt
        missing = await self._executor.missing(state)
        recovered = recover(state, at, missing, self._safety, self._why_safe)
        await self._commit(recovered.state, [(event, at) for event in recovered.events])
        await self._executor.prepare(recovered.state)
        self._bus.tell(recovered.events)
        for effect in (*recovered.effects, *noting_all(recovered.state)):
            self._executor.start(effect)
        watched = {INSTALLED, *self._unscanned}
        for kind in {drive.kind for drive in recovered.state.drives.values()} - watched:
            self._bus.emit(DrivesScanned(kind, ()))

    async def _stop(self) -> None:
        """Write down that this daemon ended because it was told to: nothing is to blame for it."""
        state = self._catalogue.state
        with contextlib.suppress(sqlite3.Error, OSError):
            stopped = HostStopped(state.host)
            entries = entries_of([(stopped, self._bus.clock())], state, state, self._catalogue.boot)
            await self._catalogue.commit(replace(state, is_stopped=True), list(entries))

    def _tell_loss(self, before: HostState, after: HostState) -> None:
        assert self._catalogue.loss is not None
        found = [p.payload_id for key, p in after.payloads.items() if key not in before.payloads]
        problem = opening.problem_of(self._catalogue.loss, tuple(found))
        log.warning("%s", problem)
        self._bus.emit(CatalogueSetAside(after.host, (problem,)))

    async def _follow_all(self) -> None:
        while True:
            patience = COMMIT_AGAIN_S if self._catalogue.unwritten else None
            try:
                async with asyncio.timeout(patience):
                    batch = await self._bus.batch()
            except TimeoutError:
                batch = []
            await self._follow(batch)

    async def _follow(self, batch: Sequence[Stamped]) -> None:
        """Events that waited together share one commit."""
        self._unscanned -= {event.kind for event, _ in batch if isinstance(event, DrivesScanned)}
        outcome, told = _advance_all(self._catalogue.state, batch)
        may_wait = all(type(event) in HELD for event, _ in (*batch, *told))
        await self._commit(outcome.state, told, may_wait=may_wait and bool(batch))
        self._executor.adopt(outcome.state)
        for effect in outcome.effects:  # first: a person waits for what comes of them
            self._executor.start(effect)
        early = {id(event) for event, _ in batch if self._bus.is_told_early(event)}
        self._bus.tell([event for event in outcome.events if id(event) not in early])

    async def _commit(
        self, after: HostState, told: Sequence[Stamped], *, may_wait: bool = False
    ) -> None:
        """Write a state down. Where that cannot be done, go on with it all the same: what was
        pulled must go, whatever the disk does. What is owed is written as soon as it can be; what
        `may_wait`, with the next state."""
        catalogue = self._catalogue
        before, loss, unwritten = catalogue.state, catalogue.loss, catalogue.unwritten
        if after is before and not told and unwritten is None:
            return
        entries = list(entries_of(told, before, after, catalogue.boot))
        if may_wait and unwritten is None:
            catalogue.hold(after, entries)
            return
        tries_left = COMMIT_TRIES if unwritten is None else 0
        while True:
            try:
                await catalogue.commit(after, entries)
                break
            except (sqlite3.Error, OSError) as error:
                if not tries_left:
                    catalogue.owe(after, entries, error)
                    break
                log.warning("the catalogue cannot be written; trying again: %s", error)
                tries_left -= 1
                await asyncio.sleep(COMMIT_AGAIN_S)
        if catalogue.loss is not loss:
            self._tell_loss(after, after)
        if (catalogue.unwritten is None) != (unwritten is None):
            self._tell_whether_written()
        self._try(after)

    def _tell_whether_written(self) -> None:
        host, unwritten = self._catalogue.state.host, self._catalogue.unwritten
        if unwritten is None:
            self._bus.emit(CatalogueWritten(host))
        else:
            log.error("%s", unwritten)
            self._bus.emit(CatalogueUnwritten(host, (unwritten,)))

    def _try(self, state: HostState) -> None:
        """See after a while whether all is well with what others may have died of.

        The while begins once it is known what is plugged in: a slow host is not well for the
        reason that it has not looked yet.
        """
        if state.tries and self._trial is None and not self._unscanned:
            self._trial = asyncio.get_running_loop().call_later(self._steady_s, self._tried)

    def _tried(self) -> None:
        self._trial = None
        self._bus.emit(HostStable(self._catalogue.state.host))
        self._try(self._catalogue.state)


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

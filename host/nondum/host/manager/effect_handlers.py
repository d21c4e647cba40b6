"""Carries effects out, one at a time for each payload and drive, and reports by events.

What fails is reported as a refusal or failure with its problems: the component manager never waits
for an effect that says nothing.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Awaitable, Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from nondum.host.core import effects
from nondum.host.core.effects import Effect
from nondum.host.core.events.drives import DriveUnreadable
from nondum.host.core.events.event import Emit, Event
from nondum.host.core.events.payloads import PayloadCleared, PayloadFailed, PayloadRefused
from nondum.host.core.keyed_queues import KeyedQueues
from nondum.host.core.records.moment import Moment
from nondum.host.core.state import HostState
from nondum.host.jobs.children import Children
from nondum.host.jobs.idle_scheduling import IdleScheduler
from nondum.host.lifecycle import payload_rules
from nondum.host.manager.drive_reading import DriveReading
from nondum.host.manager.install_options import InstallOptions
from nondum.host.manager.installation import Installation
from nondum.host.manager.payload_trust import PayloadTrust
from nondum.host.manager.state_folders import Folders
from nondum.host.workers.workers import Workers
from nondum.sdk.errors import DriveGone, NondumError, Problem
from nondum.wheelhouse.store import disk

_Handler = Callable[[Any], Awaitable[tuple[Event, ...]]]

_INSTEAD = (
    effects.CopyPayload,
    effects.RestPayload,
    effects.SuspendPayload,
    effects.ClearPayload,
    effects.ReleaseDrive,
)
"""Effects that make what is being done for the same payload or drive pointless."""

log = logging.getLogger(__name__)


class Executor:
    """Runs the effect handlers of the component manager. `close` it, before the workers."""

    def __init__(
        self,
        host: str,
        folders: Folders,
        workers: Workers,
        emit: Emit,
        options: InstallOptions | None = None,
    ) -> None:
        options = options or InstallOptions()
        self._workers, self._emit = workers, emit
        self.children = Children(on_crowded=workers.search.begin, stays=options.forks_stay)
        self.trust = PayloadTrust(
            host, folders, self.children, options.trust, allow_unsigned=options.allow_unsigned
        )
        self._queues = KeyedQueues()
        self._quiet = IdleScheduler()
        self._is_prune_waiting = self._is_fill_waiting = False
        self._drives = DriveReading(self.children, emit, self.trust, options.look_s)
        self.installation = Installation(
            host, folders, workers, self.children, emit, options, self.trust
        )
        self._handlers: Mapping[type[Effect], _Handler] = {
            effects.JudgePayloads: self.trust.judged,
            effects.ReadDrive: self._drives.read,
            effects.ReleaseDrive: self._drives.release,
            effects.CopyPayload: self.installation.copy,
            effects.VerifyPayload: self.installation.verify,
            effects.StagePayload: self.installation.stage,
            effects.StoreWheels: self.installation.store,
            effects.ProbeComponents: self.installation.probe,
            effects.ActivatePayload: self.installation.activate,
            effects.CompileWheels: self._compile,
            effects.NoteInstalled: self.installation.note,
            effects.RestPayload: self.installation.rest,
            effects.SuspendPayload: self.installation.suspend,
            effects.ClearPayload: self.installation.clear,
            effects.CachePayload: self._cache,
            effects.RestartWorker: self._restart,
            effects.AttachDevice: self._attach,
            effects.DetachDevice: self._detach,
            effects.ShowData: self.installation.shown.show,
            effects.HideData: self.installation.shown.hide,
        }

    async def rebuild(self, state: HostState, at: Moment) -> HostState:
        """The state, with what is installed for good and is not in it."""
        return await self.installation.rebuild(state, at)

    async def missing(self, state: HostState) -> frozenset[str]:
        """Payloads of the state whose files are gone."""
        return await self.installation.missing(state)

    async def prepare(self, state: HostState) -> None:
        """Clear away what a recovered state does not account for; start a spare child."""
        read, _ = await asyncio.gather(self.trust.open(), self.installation.prepare(state))
        for event in read:
            self._emit(event)
        if payloads := payload_rules.kept(state):
            self.start(effects.JudgePayloads(payloads))

    async def judged_by(self, beside: str) -> Mapping[str, Any]:
        """What child processes judge a payload by that is not here yet: the trust of this host, and
        the memory that there is for it, `beside` a release of it or ""."""
        return {**self.trust.arguments, "headroom": await self.installation.headroom(beside)}

    def adopt(self, state: HostState) -> None:
        """Have the workers stand for components that the catalogue says."""
        self._workers.take_over({id: c.payload for id, c in state.components.items()})

    def start(self, effect: Effect) -> None:
        """Set an effect going."""
        instead = isinstance(effect, _INSTEAD)
        self._queues.add(_queue_of(effect), partial(self._carry_out, effect), instead=instead)

    async def close(self) -> None:
        """Give up what is being done, unmount drives, end children. Workers are their owner's."""
        await self._queues.close()
        await self._drives.close()
        await self.children.close()

    async def _carry_out(self, effect: Effect) -> None:
        try:
            with self._urgent(effect):
                reported = await self._handlers[type(effect)](effect)
        except NondumError as error:
            reported = _failure(effect, error)
        except Exception as error:
            log.exception("%r", effect)
            reported = _failure(effect, _translated(effect, error))
        for event in reported:
            self._emit(event)
        if isinstance(effect, effects.ClearPayload):  # nothing uses its wheels now
            self._want_prune()

    def _urgent(self, effect: Effect) -> contextlib.AbstractContextManager[None]:
        can_wait = isinstance(effect, effects.CompileWheels)
        return contextlib.nullcontext() if can_wait else self._quiet.urgent()

    async def _compile(self, effect: effects.CompileWheels) -> tuple[Event, ...]:
        return await self._quiet.run(partial(self.installation.compile, effect))

    async def _cache(self, effect: effects.CachePayload) -> tuple[Event, ...]:
        told = await self.installation.cache(effect)
        if not self._is_fill_waiting:  # one that is to come serves all that are cached till then
            self._is_fill_waiting = True
            self._queues.add("cache", partial(self._quiet.run, self._fill_cache))
        return told

    async def _fill_cache(self) -> None:
        try:
            await self.installation.fill_cache()
        except asyncio.CancelledError:  # for something urgent: it is begun again
            raise
        except Exception:
            log.exception("what was withdrawn is not cached")
        self._is_fill_waiting = False

    def _want_prune(self) -> None:
        """Have the store pruned; one that is to come serves all who have asked till then."""
        if not self._is_prune_waiting:
            self._is_prune_waiting = True
            self._queues.add("store", self._prune)

    async def _prune(self) -> None:
        self._is_prune_waiting = False
        # What fails is tried again when the next payload goes.
        with contextlib.suppress(NondumError), self._quiet.urgent():
            await self.installation.prune()

    async def _restart(self, effect: effects.RestartWorker) -> tuple[Event, ...]:
        await self._workers.restart(effect.component)
        return ()

    async def _attach(self, effect: effects.AttachDevice) -> tuple[Event, ...]:
        first, *others = ((str(node.node), node.properties) for node in effect.nodes)
        await self._workers.attach(effect.component, effect.need, *first, others)
        return ()

    async def _detach(self, effect: effects.DetachDevice) -> tuple[Event, ...]:
        await self._workers.detach(effect.component, effect.need)
        return ()


def _translated(effect: Effect, error: Exception) -> NondumError:
    """The error to report for an exception that no layer below has translated."""
    what = type(effect).__name__
    if isinstance(error, OSError):
        return disk.failed(error, what, Path(error.filename or ""))
    if disk.is_short_of_memory(error):
        text, fix = f"{what}: there is no memory left", "pull a payload, and try again"
        return NondumError(Problem("NO_MEMORY", text, fix=fix))
    fix = "see the log, and report it with what it says"
    return NondumError(Problem("INTERNAL", f"{what}: {error!r}", fix=fix))


def _queue_of(effect: Effect) -> str:
    match effect:
        case effects.PayloadEffect():
            return f"payload {effect.payload}"
        case effects.JudgePayloads():
            return "trust"
        case effects.ReadDrive() | effects.ReleaseDrive():
            return f"drive {effect.drive}"
        case effects.RestartWorker() | effects.AttachDevice() | effects.DetachDevice():
            return f"component {effect.component}"
        case effects.ShowData() | effects.HideData():
            return f"component {effect.component}"
        case _:
            raise TypeError(f"no lane for {effect!r}")


def _failure(effect: Effect, error: NondumError) -> tuple[Event, ...]:
    """What an effect that failed reports."""
    match effect:
        case effects.ReadDrive():
            return (DriveUnreadable(effect.drive, error.problems),)
        case effects.CopyPayload() if isinstance(error, DriveGone):
            return (DriveUnreadable(effect.drive, error.problems),)
        case effects.ProbeComponents() | effects.ActivatePayload():
            return (PayloadFailed(effect.payload, error.problems),)
        case effects.ClearPayload():
            log.error("%s is not cleared away whole: %s", effect.payload, error)
            return (PayloadCleared(effect.payload),)
        case effects.RestPayload() | effects.SuspendPayload():
            log.error("%s is not suspended whole: %s", effect.payload, error)
            return ()
        case effects.NoteInstalled():
            log.warning("%s: the note of its installation is not kept: %s", effect.payload, error)
            return ()
        case effects.CompileWheels():
            log.info("%s stays as it is, not all compiled: %s", effect.payload, error)
            return ()
        case effects.PayloadEffect():
            return (PayloadRefused(effect.payload, error.problems),)
        case _:
            log.warning("%r failed: %s", effect, error)
            return ()

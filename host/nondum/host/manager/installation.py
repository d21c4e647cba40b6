"""What is done for one payload, from copying it to deleting it: each method one effect.

Each may be done again after a crash, and leaves either its result or what was there before.
"""

from __future__ import annotations

import asyncio
import logging
import shutil
import time
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from nondum.host.config import component_settings
from nondum.host.core import effects
from nondum.host.core.events.event import Emit, Event
from nondum.host.core.events.payloads import (
    ComponentsProbed,
    PayloadActivated,
    PayloadCached,
    PayloadCleared,
    PayloadCopied,
    PayloadStaged,
    PayloadVerified,
    ProgressMade,
    WheelsCompiled,
    WheelsStored,
)
from nondum.host.core.events.releases import BesideRefused
from nondum.host.core.keyed_queues import in_thread
from nondum.host.core.records.moment import Moment
from nondum.host.core.state import HostState
from nondum.host.jobs.children import STALL_S, Children
from nondum.host.jobs.queue import Queue
from nondum.host.lifecycle.rebuilding import with_found, write_note
from nondum.host.lifecycle.retry_causes import Amounts
from nondum.host.manager.drive_reading import stalls_as_drive_gone
from nondum.host.manager.install_options import InstallOptions
from nondum.host.manager.installed_payload import InstalledPayload
from nondum.host.manager.memory_reservations import MemoryReservations
from nondum.host.manager.payload_cache import PayloadCache
from nondum.host.manager.payload_trust import PayloadTrust
from nondum.host.manager.shown_data import ShownData
from nondum.host.manager.state_folders import (
    Folders,
    missing,
    move,
    of_another_python,
    remove,
    sweep,
)
from nondum.host.workers.leftovers import end_leftovers
from nondum.host.workers.role import Role
from nondum.host.workers.spec import base_interpreter
from nondum.host.workers.workers import Workers
from nondum.sdk.codec.values import from_plain
from nondum.sdk.description import PluginDescription
from nondum.sdk.errors import NondumError, WorkerFailed, problems_of
from nondum.wheelhouse.payload.memory import Memory, Promised, free_memory_mb
from nondum.wheelhouse.store import disk

AT_ONCE = 2
"""Payloads that are brought in at the same time, from the first byte copied until they are active
or refused; the others wait."""

COPY_SILENCE_S = 20.0
"""A drive that gives not a megabyte in this time hangs."""

OWN = "store"
"""Owner of the children that read nothing but what was checked before."""

STOP_S = 1.5
"""What workers have to end once their payload is withdrawn; the rest of the two promised seconds
is for deleting."""

log = logging.getLogger(__name__)


class Installation:
    """Brings payloads to life, and removes them."""

    def __init__(
        self,
        host: str,
        folders: Folders,
        workers: Workers,
        children: Children,
        emit: Emit,
        options: InstallOptions,
        trust: PayloadTrust,
    ) -> None:
        self._host, self._folders, self._options = host, folders, options
        self._trust = trust
        self._workers, self._children, self._emit = workers, children, emit
        self.shown = ShownData(folders, workers)
        self._installed: dict[str, InstalledPayload] = {}
        self._reservations = MemoryReservations(workers.pids_of)
        self._queue = Queue(AT_ONCE)
        self._drives: dict[str, str] = {}
        """Payload → the drive that it was copied from: the owner of the children that read it."""
        self._store = asyncio.Lock()
        """One process writes to the store, and to the cache."""
        self._cache = PayloadCache(folders, children)
        self._restored: dict[str, dict[str, Any]] = {}
        """Payload on its way in whose venvs come from the cache → what `install` would tell."""

    async def rebuild(self, state: HostState, at: Moment) -> HostState:
        """The state, with what is installed for good and is not in it."""
        notes, payloads = self._folders.notes, self._folders.payloads
        arguments = self._arguments(notes=str(notes), payloads=str(payloads))
        return with_found(state, await self._children.run("found", arguments), at)

    async def missing(self, state: HostState) -> frozenset[str]:
        """Payloads of the state whose files are gone, or that have none for this Python."""
        gone = await in_thread(missing, self._folders, state)
        if not (others := of_another_python(state) - gone):
            return gone
        folders = [str(self._folders.payload(key)) for key in sorted(others)]
        try:
            lacking = await self._children.run("without_wheels", self._arguments(folders=folders))
        except NondumError as error:  # then each is found out when it is brought up
            log.warning("wheels for this Python are not looked for: %s", error)
            return gone
        return gone.union(lacking)

    async def prepare(self, state: HostState) -> None:
        """Clear away what a recovered state does not account for. What cannot be is left."""
        await in_thread(end_leftovers, self._folders.scratches)
        await in_thread(sweep, self._folders, state)
        try:
            await self._children.run("sweep", self._arguments())
        except NondumError as error:
            log.warning("the store is not swept: %s", error)

    async def note(self, effect: effects.NoteInstalled) -> tuple[Event, ...]:
        """Keep the note that tells what is installed for good."""
        note = self._folders.note(effect.payload)
        await in_thread(write_note, note, effect.drive, effect.folder)
        return ()

    async def copy(self, effect: effects.CopyPayload) -> tuple[Event, ...]:
        """Copy to a staging folder that is empty at first, or move there what is cached."""
        staging = self._folders.staging(effect.payload)
        self._drives[effect.payload] = effect.drive
        await self._queue.enter(effect.payload, partial(self._tell_queued, effect.payload))
        await in_thread(remove, staging)
        if effect.payload in self._cache:
            known = await self._restore(effect, staging)
            if known is not None:
                return (PayloadCopied(effect.payload, 0, known),)
        arguments = self._arguments(
            folder=str(effect.folder),
            digest=effect.digest,
            staging=str(staging),
            headroom=await self._reservations.headroom(effect.payload, effect.beside),
        )
        with stalls_as_drive_gone(effect.drive, COPY_SILENCE_S):
            copied = await self._run("copy", effect.payload, arguments, COPY_SILENCE_S)
        return (PayloadCopied(effect.payload, copied["copied"], copied["known"]),)

    async def verify(self, effect: effects.VerifyPayload) -> tuple[Event, ...]:
        """Check the staged copy; what was cached has been checked."""
        if (restored := self._restored.get(effect.payload)) is not None:
            rows = restored["components"]
            index = {row["id"]: from_plain(PluginDescription, row["description"]) for row in rows}
            return (PayloadVerified(effect.payload, tuple(index), index),)
        arguments = self._arguments(staging=str(self._folders.staging(effect.payload)))
        said = await self._run("verify", effect.payload, arguments)
        index = {id: PluginDescription.parse(told, where=id) for id, told in said.items()}
        return (PayloadVerified(effect.payload, tuple(index), index),)

    async def stage(self, effect: effects.StagePayload) -> tuple[Event, ...]:
        """Move the checked copy to its lasting place."""
        staging, lasting = (
            self._folders.staging(effect.payload),
            self._folders.payload(effect.payload),
        )
        await in_thread(move, staging, lasting)
        return (PayloadStaged(effect.payload),)

    async def store(self, effect: effects.StoreWheels) -> tuple[Event, ...]:
        """Fill the store and make the venvs, unless they were cached."""
        key = effect.payload
        if (restored := self._restored.pop(key, None)) is not None:
            await in_thread(_sync, self._folders.payload(key))
            self._installed[key] = made = self._parsed(key, restored, effect.renamed)
            self._promise(made)
        else:
            made = await self._install(key, effect.renamed, admit_beside=effect.beside)
        return (WheelsStored(key, made.fresh),)

    async def probe(self, effect: effects.ProbeComponents) -> tuple[Event, ...]:
        """Start all workers, or none. Raises `WorkerFailed` with what every one did wrong."""
        key = effect.payload
        installed = self._installed.get(key)
        if installed is None:  # a restart of the daemon, or another try
            installed = await self._install(key, effect.renamed)
        self._reservations.make(key, installed.needs)
        if effect.beside and (
            reason := await self._reservations.why_not_beside(key, effect.beside)
        ):
            return (BesideRefused(key, reason),)
        settings = await asyncio.to_thread(component_settings.load, self._options.settings)
        await self._workers.ended(effect.after)
        await self.shown.prepare(key, (c.id for c in installed.components if c.data))
        role = Role.BESIDE if effect.beside else Role.ACTIVE
        specs = installed.specs(self._options.limits, settings)
        started = await asyncio.gather(
            *(self._workers.start(spec, role) for spec in specs), return_exceptions=True
        )
        failed = [error for error in started if isinstance(error, BaseException)]
        if failed:
            await self._stop(key, installed.ids)
            known = [error for error in failed if isinstance(error, NondumError)]
            if len(known) < len(failed):
                raise next(error for error in failed if not isinstance(error, NondumError))
            raise WorkerFailed(*problems_of(known))
        return (ComponentsProbed(key),)

    async def activate(self, effect: effects.ActivatePayload) -> tuple[Event, ...]:
        """Make the records that the catalogue takes in at once."""
        key = effect.payload
        installed = self._installed[key]
        if effect.beside:
            await asyncio.gather(*(self._workers.watched(id, key) for id in installed.ids))
        self._queue.leave(key)
        records = tuple(  # with what has gone wrong since they were started
            replace(record, problems=self._workers.dead_conditions(record.id, key))
            for record in installed.records()
        )
        poses = installed.poses(self._host)
        return (
            PayloadActivated(key, records, poses, installed.grant, installed.goals, installed.data),
        )

    async def compile(self, effect: effects.CompileWheels) -> tuple[Event, ...]:
        """Byte-compile in the store what it runs, and link that into its venvs.

        What pip installed is left as it is.
        """
        key = effect.payload
        installed = self._installed.get(key)
        if installed is not None and not installed.is_compiled:
            async with self._store:
                await self._children.run_aside("compile", self._arguments(**self._places(key)))
            if (still := self._installed.get(key)) is not None:  # it may be deleted meanwhile
                self._installed[key] = replace(still, is_compiled=True)
        return (WheelsCompiled(key),)

    async def rest(self, effect: effects.RestPayload) -> tuple[Event, ...]:
        """Keep all of a payload but its processes."""
        self._queue.leave(effect.payload)
        await self._stop(effect.payload, effect.components)
        self._reservations.give_up(effect.payload)
        await in_thread(end_leftovers, self._folders.scratches_of(effect.payload))
        return ()

    async def suspend(self, effect: effects.SuspendPayload) -> tuple[Event, ...]:
        """Keep of a payload only what another try needs."""
        await self._stop(effect.payload, effect.components)
        await self._delete(effect, self._folders.venvs(effect.payload))
        return ()

    async def clear(self, effect: effects.ClearPayload) -> tuple[Event, ...]:
        """Keep nothing of a payload but its wheels in the store, as far as the quota goes."""
        await self._stop(effect.payload, effect.components)
        await self._delete(effect, *self._folders.of(effect.payload))
        return (PayloadCleared(effect.payload),)

    async def cache(self, effect: effects.CachePayload) -> tuple[Event, ...]:
        """The same, but keep its checked files, too, of which `fill_cache` makes venvs again."""
        key = effect.payload
        installed = self._installed.get(key)
        if installed is not None and self._options.method == "store":
            await self._stop(key, effect.components)
            try:
                await in_thread(self._cache.put, key, installed.told)
            except OSError as error:
                log.info("%s is not cached: %s", key, error)
        return await self.clear(effect)

    async def fill_cache(self) -> None:
        """Make the venvs of payloads that were withdrawn and are still away."""
        while (key := self._cache.unfilled) is not None:
            async with self._store:
                if await self._cache.fill(key, self._arguments(python=str(base_interpreter()))):
                    self._emit(PayloadCached(key))

    async def prune(self) -> None:
        """Bring the store down to its quota; what is cached goes first."""
        async with self._store:
            payloads = [str(folder) for folder in self._folders.all_payloads()]
            arguments = self._arguments(folders=payloads, quota_mb=self._options.quota_mb)
            if await self._children.run("prune", arguments, owner=OWN):
                await in_thread(self._cache.clear)

    async def listing(self) -> list[dict[str, Any]]:
        """What the store holds: wheel, bytes, used_by (payload keys), sha256."""
        payloads = [str(folder) for folder in self._folders.all_payloads()]
        rows: list[dict[str, Any]] = await self._children.run(
            "listing", self._arguments(folders=payloads), owner=OWN
        )
        return rows

    async def headroom(self, beside: str) -> dict[str, Any]:
        """The memory that there is for a payload that is not here yet, for children; it may take
        over from a release of it."""
        return await self._reservations.headroom("", beside)

    async def amounts(self) -> Amounts:
        """What there is for a payload that is not here yet."""
        promised = Promised.parse((await self.headroom(""))["promised"])
        disk_mb, memory = await in_thread(self._looked_at)
        gpu_mb = self._reservations.gpu_mb - promised.gpu_memory_mb
        left_mb = Memory(memory, promised=promised).left_mb()
        return Amounts(disk_mb, left_mb, gpu_mb, time.time() - time.monotonic())

    def _looked_at(self) -> tuple[int, int]:
        free_mb = shutil.disk_usage(self._folders.root).free // 2**20
        return free_mb - self._options.reserve_mb, free_memory_mb()

    async def _install(
        self, key: str, renamed: Mapping[str, str], *, admit_beside: str | None = None
    ) -> InstalledPayload:
        """Run the job `install`.

        A payload that is to be let in, beside a release or "", is refused if its memory is
        promised to others. It is promised some before the next one asks.
        """
        arguments = self._arguments(python=str(base_interpreter()), **self._places(key))
        async with self._store:
            headroom = None
            if admit_beside is not None:
                headroom = await self._reservations.headroom(key, admit_beside)
            told = await self._run("install", key, {**arguments, "headroom": headroom})
            installed = self._parsed(key, told, renamed)
            self._promise(installed)
        self._installed[key] = installed
        return installed

    async def _restore(self, effect: effects.CopyPayload, staging: Path) -> int | None:
        """Move what is cached of a payload to staging; the bytes that are not copied. None: it is
        not as it was."""
        key = effect.payload
        async with self._store:
            if (told := self._cache.told_of(key)) is None:  # it is pulled and back in no time
                await in_thread(self._cache.drop, key)
                return None
            headroom = await self._reservations.headroom(key, effect.beside)
            self._promise(self._parsed(key, told, {}))  # before others ask what there is
        arguments = self._arguments(
            folder=str(effect.folder), digest=effect.digest, headroom=headroom
        )
        run = partial(self._run, "restore", key, stall_s=COPY_SILENCE_S)
        with stalls_as_drive_gone(effect.drive, COPY_SILENCE_S):
            restored = await self._cache.restore(key, run, arguments, staging)
        if restored is None:
            return None
        self._restored[key] = restored
        known: int = restored["known"]
        return known

    def _promise(self, installed: InstalledPayload) -> None:
        """Reserve the memory that it needs."""
        self._reservations.make(installed.key, installed.needs)
        self._reservations.saw_gpu(installed.gpu)

    def _parsed(
        self, key: str, told: Mapping[str, Any], renamed: Mapping[str, str]
    ) -> InstalledPayload:
        return InstalledPayload.parse(key, told, renamed, self._folders)

    def _tell_queued(self, payload: str, ahead: int) -> None:
        self._emit(ProgressMade(payload, "queued" if ahead else "copy", 0, ahead))

    async def _run(
        self, job: str, payload: str, arguments: dict[str, Any], stall_s: float = STALL_S
    ) -> Any:
        def on_progress(phase: str, done: int, total: int) -> None:
            self._emit(ProgressMade(payload, phase, done, total))

        owner = self._drives.get(payload, payload)
        return await self._children.run(
            job, arguments, owner=owner, on_progress=on_progress, stall_s=stall_s
        )

    async def _stop(self, payload: str, components: tuple[str, ...]) -> None:
        await asyncio.gather(*(self._workers.stop(id, STOP_S, payload) for id in components))

    async def _delete(
        self, effect: effects.ClearPayload | effects.SuspendPayload, *folders: Path
    ) -> None:
        self._queue.leave(effect.payload)
        await self._children.release(self._drives.pop(effect.payload, effect.payload))
        self._installed.pop(effect.payload, None)
        self._restored.pop(effect.payload, None)
        self._reservations.give_up(effect.payload)
        scratches = self._folders.scratches_of(effect.payload)
        await in_thread(end_leftovers, scratches)
        await in_thread(_remove_all, (*folders, scratches))

    def _places(self, key: str) -> dict[str, str]:
        """Where a payload's metadata and venvs are."""
        folder, venvs = self._folders.payload(key), self._folders.venvs(key)
        return {"folder": str(folder), "venvs": str(venvs)}

    def _arguments(self, **more: Any) -> dict[str, Any]:
        return {
            "store": str(self._folders.store),
            "reserve_mb": self._options.reserve_mb,
            "confinement": str(self._workers.launcher.level),
            "method": self._options.method,
            "most": self._options.most.given(),
            **self._trust.arguments,
            **more,
        }


def _sync(folder: Path) -> None:
    """Have a payload's checked files on disk; its signature may be new, and its place is."""
    disk.sync_files(folder)
    disk.sync(folder.parent)


def _remove_all(folders: Iterable[Path]) -> None:
    for folder in folders:
        remove(folder)

"""What is done for one payload, from copying it to deleting it: each method one effect.

Each may be done again after a crash, and leaves either its result or what was there before.
"""

from __future__ import annotations

import asyncio
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from nondum.host import effects
from nondum.host.catalogue.state import HostState
from nondum.host.events import (
    ComponentsProbed,
    Emit,
    Event,
    PayloadActivated,
    PayloadCleared,
    PayloadCopied,
    PayloadStaged,
    PayloadVerified,
    ProgressMade,
    WheelsCompiled,
    WheelsStored,
)
from nondum.host.lifecycle.children import Children
from nondum.host.lifecycle.folders import Folders, remove, sweep
from nondum.host.lifecycle.lanes import in_thread
from nondum.host.lifecycle.prepared import Prepared
from nondum.host.workers import Limits, Workers, base_interpreter, end_leftovers
from nondum.sdk.errors import NondumError, WorkerFailed, problems_of

AT_ONCE = 2
"""Payloads that are copied or checked at the same time; the others wait."""

STOP_S = 1.5
"""What workers have to end once their payload is withdrawn; the rest of the two promised seconds
is for deleting."""


@dataclass(frozen=True, slots=True)
class InstallOptions:
    """How payloads are judged and installed on this host."""

    allow_unsigned: bool = False
    method: str = "store"
    """`store`: links to the store. `pip`: pip itself."""
    reserve_mb: int = 64
    """Disk that is left free."""
    quota_mb: int = 4096
    """Size that the store is pruned to."""
    limits: Limits = field(default_factory=Limits)
    """Of each worker."""


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
    ) -> None:
        self._host, self._folders, self._options = host, folders, options
        self._workers, self._children, self._emit = workers, children, emit
        self._prepared: dict[str, tuple[Prepared, ...]] = {}
        self._turns = asyncio.Semaphore(AT_ONCE)
        self._store = asyncio.Lock()
        """One process writes to the store."""
        self._uncompiled: set[str] = set()
        """Payloads whose workers would be started sooner if their modules were compiled."""

    async def prepare(self, state: HostState) -> None:
        """Clear away what a recovered state does not account for."""
        await in_thread(end_leftovers, self._folders.scratches)
        await in_thread(sweep, self._folders, state)
        await self._children.run("sweep", self._arguments())

    async def copy(self, effect: effects.CopyPayload) -> tuple[Event, ...]:
        """Copy to a staging folder that is empty at first."""
        staging = self._folders.staging(effect.payload)
        await in_thread(remove, staging)
        arguments = self._arguments(
            folder=str(effect.folder), digest=effect.digest, staging=str(staging)
        )
        async with self._turns:
            copied = await self._run("copy", effect.payload, arguments)
        return (PayloadCopied(effect.payload, copied["copied"], copied["known"]),)

    async def verify(self, effect: effects.VerifyPayload) -> tuple[Event, ...]:
        """Check the staged copy."""
        arguments = self._arguments(staging=str(self._folders.staging(effect.payload)))
        async with self._turns:
            components = await self._run("verify", effect.payload, arguments)
        return (PayloadVerified(effect.payload, tuple(components)),)

    async def stage(self, effect: effects.StagePayload) -> tuple[Event, ...]:
        """Move the checked copy to its lasting place."""
        staging, lasting = (
            self._folders.staging(effect.payload),
            self._folders.payload(effect.payload),
        )
        await in_thread(_move, staging, lasting)
        return (PayloadStaged(effect.payload),)

    async def store(self, effect: effects.StoreWheels) -> tuple[Event, ...]:
        """Fill the store and make the venvs."""
        fresh = await self._install(effect.payload)
        return (WheelsStored(effect.payload, fresh),)

    async def probe(self, effect: effects.ProbeComponents) -> tuple[Event, ...]:
        """Start all workers, or none. Raises `WorkerFailed` with what every one did wrong."""
        key = effect.payload
        if key not in self._prepared:  # a restart of the daemon, or another try
            await self._install(key)
        specs = [component.spec(key, self._options.limits) for component in self._prepared[key]]
        started = await asyncio.gather(
            *(self._workers.start(spec) for spec in specs), return_exceptions=True
        )
        failed = [error for error in started if isinstance(error, BaseException)]
        if failed:
            await self._stop(tuple(component.id for component in self._prepared[key]))
            known = [error for error in failed if isinstance(error, NondumError)]
            if len(known) < len(failed):
                raise next(error for error in failed if not isinstance(error, NondumError))
            raise WorkerFailed(*problems_of(known))
        return (ComponentsProbed(key),)

    async def activate(self, effect: effects.ActivatePayload) -> tuple[Event, ...]:
        """Make the records that the catalogue takes in at once."""
        prepared = self._prepared[effect.payload]
        return (
            PayloadActivated(
                effect.payload,
                tuple(component.record(effect.payload) for component in prepared),
                tuple(pose for component in prepared for pose in component.poses(self._host)),
            ),
        )

    async def compile(self, effect: effects.CompileWheels) -> tuple[Event, ...]:
        """Byte-compile in the store what it runs, and link that into its venvs.

        What pip installed is left as it is.
        """
        if effect.payload in self._uncompiled:
            arguments = self._arguments(**self._places(effect.payload))
            async with self._store:
                await self._children.run_aside("compile", arguments)
            self._uncompiled.discard(effect.payload)
        return (WheelsCompiled(effect.payload),)

    async def suspend(self, effect: effects.SuspendPayload) -> tuple[Event, ...]:
        """Keep of a payload only what another try needs."""
        await self._stop(effect.components)
        await self._delete(effect, self._folders.venvs(effect.payload))
        return ()

    async def clear(self, effect: effects.ClearPayload) -> tuple[Event, ...]:
        """Keep nothing of a payload but its wheels in the store, as far as the quota goes."""
        await self._stop(effect.components)
        await self._delete(effect, *self._folders.of(effect.payload))
        return (PayloadCleared(effect.payload),)

    async def prune(self) -> None:
        """Bring the store down to its quota."""
        async with self._store:
            payloads = [str(folder) for folder in self._folders.all_payloads()]
            arguments = self._arguments(folders=payloads, quota_mb=self._options.quota_mb)
            await self._children.run("prune", arguments)

    async def listing(self) -> list[dict[str, Any]]:
        """What the store holds: wheel, bytes, used_by (payload keys), sha256."""
        payloads = [str(folder) for folder in self._folders.all_payloads()]
        rows: list[dict[str, Any]] = await self._children.run(
            "listing", self._arguments(folders=payloads)
        )
        return rows

    async def _install(self, key: str) -> int:
        """Run the job `install`; says how many wheels the store did not have."""
        arguments = self._arguments(python=str(base_interpreter()), **self._places(key))
        async with self._store:
            told = await self._run("install", key, arguments)
        if told["uncompiled"]:
            self._uncompiled.add(key)
        self._prepared[key] = tuple(
            Prepared.parse(said, self._folders.scratch(said["id"])) for said in told["components"]
        )
        return int(told["fresh"])

    async def _run(self, job: str, payload: str, arguments: dict[str, Any]) -> Any:
        def on_progress(phase: str, done: int, total: int) -> None:
            self._emit(ProgressMade(payload, phase, done, total))

        return await self._children.run(job, arguments, on_progress=on_progress)

    async def _stop(self, components: tuple[str, ...]) -> None:
        await asyncio.gather(*(self._workers.stop(id, STOP_S) for id in components))

    async def _delete(
        self, effect: effects.ClearPayload | effects.SuspendPayload, *folders: Path
    ) -> None:
        self._prepared.pop(effect.payload, None)
        self._uncompiled.discard(effect.payload)
        scratches = [self._folders.scratch(component) for component in effect.components]
        for scratch in scratches:
            await in_thread(end_leftovers, scratch)
        await in_thread(_remove_all, (*folders, *scratches))

    def _places(self, key: str) -> dict[str, str]:
        """Where a payload's metadata and venvs are."""
        folder, venvs = self._folders.payload(key), self._folders.venvs(key)
        return {"folder": str(folder), "venvs": str(venvs)}

    def _arguments(self, **more: Any) -> dict[str, Any]:
        return {
            "store": str(self._folders.store),
            "reserve_mb": self._options.reserve_mb,
            "confinement": self._workers.launcher.level,
            "method": self._options.method,
            **more,
        }


def _move(staging: Path, lasting: Path) -> None:
    """Rename a folder. Whoever says that its payload is stored sees to it that it is on disk."""
    remove(lasting)
    lasting.parent.mkdir(parents=True, exist_ok=True)
    staging.rename(lasting)


def _remove_all(folders: Iterable[Path]) -> None:
    for folder in folders:
        remove(folder)

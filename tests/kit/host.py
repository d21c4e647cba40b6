"""A host in the test process: catalogue, workers, executor, drives that are folders; no mind."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from tests.kit.until import arrived

from nondum.host.catalogue.catalogue import Catalogue
from nondum.host.core.bus import Bus
from nondum.host.core.events.daemon import HostStarted
from nondum.host.core.events.event import Event
from nondum.host.core.events.payloads import WheelsCompiled
from nondum.host.core.records.journal import JournalEntry
from nondum.host.core.records.payload import PayloadRecord
from nondum.host.core.records.snapshot import Snapshot
from nondum.host.core.records.step import Step
from nondum.host.lifecycle.advance import RULES
from nondum.host.lifecycle.crash_attribution import STEADY_S
from nondum.host.manager.component_manager import ComponentManager
from nondum.host.manager.effect_handlers import Executor
from nondum.host.manager.install_options import InstallOptions
from nondum.host.manager.state_folders import Folders
from nondum.host.sources.drives.slots import SlotSource
from nondum.host.sources.drives.source import DriveSource
from nondum.host.workers.spec import Timing
from nondum.host.workers.workers import Workers

HOST = "spot"

LAMP = '''"""A lamp that does nothing, well."""
from nondum.sdk import Fragment, Output, Unit, behaviour, hookimpl

DOMAIN = """
(define (domain lamp)
  (:predicates (lit ?u - light))
  (:action shine :parameters (?u - light) :precondition (ready ?u) :effect (lit ?u)))
"""

@hookimpl
def units():
    return [Unit("lamp", "light")]

@hookimpl
def fragments():
    return [Fragment("lamp.pddl", DOMAIN)]

@behaviour("shine", action="(shine ?u - light)", lasting=True)
async def shine(ctx, u):
    await ctx.established()
    await ctx.sleep(3600)
'''


@dataclass
class HostInProcess:
    """A running host, without its mind."""

    catalogue: Catalogue
    manager: ComponentManager
    executor: Executor
    workers: Workers
    bus: Bus
    folders: Folders
    slots: Path
    drives: Path
    heard: list[Event] = field(default_factory=list)

    def plug(self, drive: Path, name: str = "a") -> None:
        """Put a drive into a slot."""
        (self.slots / name).symlink_to(drive)

    def pull(self, name: str = "a") -> None:
        """Take a drive out of its slot."""
        (self.slots / name).unlink()

    @property
    def snapshot(self) -> Snapshot:
        return self.catalogue.snapshot()

    def payload(self, payload_id: str) -> PayloadRecord | None:
        return next((p for p in self.snapshot.payloads if p.payload_id == payload_id), None)

    async def until(self, holds: Callable[[], bool]) -> None:
        """Wait until something holds; looked at again after each event."""
        changed = asyncio.Event()
        end = self.bus.subscribe(lambda event: changed.set())

        async def held() -> None:
            while not holds():
                changed.clear()
                await changed.wait()

        try:
            await arrived("what is waited for", held(), evidence=self._evidence)
        finally:
            end()

    async def until_step(self, payload_id: str, step: Step) -> PayloadRecord:
        """Wait for a payload to come to a step."""

        def holds() -> bool:
            record = self.payload(payload_id)
            if record is not None and record.step in (Step.REFUSED, Step.QUARANTINED):
                assert record.step is step, [str(problem) for problem in record.problems]
            return record is not None and record.step is step

        await self.until(holds)
        record = self.payload(payload_id)
        assert record is not None
        return record

    def release(self, payload_id: str, number: int) -> PayloadRecord | None:
        """One release of a payload, if it is there."""
        every = (p for p in self.snapshot.payloads if p.payload_id == payload_id)
        return next((p for p in every if p.release == number), None)

    async def until_releases(self, payload_id: str, **wanted: Step | None) -> None:
        """Wait until releases (`r1=…`) are at steps; None: gone."""

        def holds() -> bool:
            found = {name: self.release(payload_id, int(name[1:])) for name in wanted}
            return all((one.step if one else None) is wanted[name] for name, one in found.items())

        await self.until(holds)

    async def until_compiled(self, payload_id: str) -> None:
        """Wait until a payload is active and its wheels have been compiled."""
        record = await self.until_step(payload_id, Step.ACTIVE)
        await self.until(lambda: WheelsCompiled(record.key) in self.heard)

    async def until_gone(self, payload_id: str) -> None:
        """Wait until nothing of a payload is left."""
        await self.until(lambda: self.payload(payload_id) is None)

    def _evidence(self) -> str:
        return "\n".join([str(self.snapshot), *map(str, self.heard[-20:])])

    async def journal(self) -> tuple[JournalEntry, ...]:
        return await self.catalogue.journal(limit=1000)


@contextlib.asynccontextmanager
async def host_in_process(
    root: Path,
    *,
    options: InstallOptions | None = None,
    timing: Timing | None = None,
    sources: Callable[[Folders], Sequence[DriveSource]] = lambda folders: (),
    steady_s: float = STEADY_S,
) -> AsyncIterator[HostInProcess]:
    """Run a host's lifecycle under `root`; its state stays there for the next one."""
    folders, slots = Folders(root / "state"), root / "slots"
    bus = Bus(RULES)
    catalogue = await Catalogue.open(folders.catalogue, HOST)
    workers = Workers(HOST, bus.emit, timing=timing)
    options = options or InstallOptions(allow_unsigned=True)
    executor = Executor(HOST, folders, workers, bus.emit, options)
    manager = ComponentManager(catalogue, executor, bus, steady_s=steady_s)
    for source in (SlotSource([slots]), *sources(folders)):
        manager.add_source(source)
    host = HostInProcess(
        catalogue, manager, executor, workers, bus, folders, slots, root / "drives"
    )
    slots.mkdir(parents=True, exist_ok=True)
    bus.subscribe(host.heard.append)
    running = asyncio.create_task(manager.run())
    try:
        await host.until(lambda: any(isinstance(event, HostStarted) for event in host.heard))
        yield host
        if running.done():
            running.result()
    finally:
        running.cancel()
        await asyncio.gather(running, return_exceptions=True)
        await workers.close()
        await catalogue.close()


def left_over(folders: Folders) -> list[Path]:
    """Every file of payloads that lies in a state folder, but for the store's."""
    names = ("staging", "payloads", "venvs", "scratch", "mounts")
    roots = [folders.root / name for name in names]
    return [path for root in roots if root.is_dir() for path in root.iterdir()]

"""A host's lifecycle in a separate process, to be killed or to be given errors.

The orders are one JSON object: `root`, and optionally

- `kill` ([when, step, event]): SIGKILL itself `BEFORE` or `AFTER` the commit of that transition, of
  a payload or (step is then a component's state) of a component,
- `nudge` ([[step, what], …]): `pull` the drive, `plug` another one, `retry` the payload, report its
  worker `lost`, `keep` what lies beside the catalogue (tests/faults/kept.py), … as soon as that
  step was committed, one after the other,
- `kill_while` (a drive's state): SIGKILL itself once a drive was committed to be in it,
- `script`: things to do one after the other, each when all that came before has settled: `plug`
  and `pull` slots, `retry`, `send` or `distrust` the payload, `end`; or `end now`.

Each commit is told in the file `told` under the root once it is acknowledged. The catalogue handed
in at the composition root does all this; nothing that is shipped knows of it.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import signal
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from tests.faults import kept

from nondum.host.catalogue.catalogue import Catalogue
from nondum.host.core.bus import Bus
from nondum.host.core.events.drives import DriveRemoved
from nondum.host.core.events.payloads import RetryAsked
from nondum.host.core.events.placement import PayloadSentAway
from nondum.host.core.events.releases import RollbackAsked
from nondum.host.core.events.trust import PayloadDistrusted
from nondum.host.core.events.workers import WorkerExited, WorkerFailed, WorkerReady
from nondum.host.core.records.drive import DriveState
from nondum.host.core.records.journal import JournalEntry
from nondum.host.core.records.step import Step
from nondum.host.core.state import HostState
from nondum.host.core.transitions import COMPONENT_TRANSITIONS, TRANSITIONS
from nondum.host.jobs.children import watched_without_threads
from nondum.host.lifecycle.advance import RULES
from nondum.host.manager import state_lock
from nondum.host.manager.component_manager import ComponentManager
from nondum.host.manager.effect_handlers import Executor
from nondum.host.manager.install_options import InstallOptions
from nondum.host.manager.state_folders import Folders
from nondum.host.service.stop_signals import told_to_stop
from nondum.host.sources.drives.slots import SlotSource
from nondum.host.workers.spec import Timing
from nondum.host.workers.workers import Workers
from nondum.sdk.errors import Problem

HOST = "spot"
SLOT, OTHER = "a", "b"
COMPONENT = "lamp"
ROWS = {(step, event.__name__): row for (step, event), row in TRANSITIONS.items()}
COMPONENT_ROWS = {
    (state, event.__name__): to for (state, event), to in COMPONENT_TRANSITIONS.items()
}
MARK = "NONDUM_FAULTS"
"""Environment variable of all that belongs to such a daemon: its root."""

OPTIONS = InstallOptions(allow_unsigned=True, reserve_mb=0)
"""Some of the disks that it lives on are small."""
QUICK = Timing(startup_s=30.0, settle_beats=1)

_AT_REST = frozenset({Step.ACTIVE, Step.SUPERSEDED, Step.REFUSED, Step.QUARANTINED})


_Row = tuple[Any, str, str]


class DeadlyCatalogue(Catalogue):
    """Obeys orders as it commits."""

    orders: dict[str, Any]
    bus: Bus
    told: int
    """Descriptor of the file `told`: it was opened before anything could fail."""
    entries = 0
    held = 0
    """Entries that no commit has written yet."""
    kept = 0
    """How often it has kept what lies beside the catalogue."""
    has_committed: asyncio.Event
    """Set whenever there is another state."""
    is_scanned = False
    """Whether this daemon knows which drives are plugged in."""

    async def commit(self, after: HostState, entries: Sequence[JournalEntry]) -> None:
        passed, parts = list(self._passed(entries)), list(self._components_passed(entries))
        self._die_if("BEFORE", passed, parts)
        await super().commit(after, entries)
        self.entries += self.held + len(entries)
        self.held = 0
        self.is_scanned |= any(entry.event == "DrivesScanned" for entry in entries)
        self.tell(f"committed {self.boot} {self.entries} {after.revision}")
        self._follow(after, passed, parts)

    def hold(self, after: HostState, entries: Sequence[JournalEntry]) -> None:
        passed, parts = list(self._passed(entries)), list(self._components_passed(entries))
        self._die_if("BEFORE", passed, parts)
        super().hold(after, entries)
        self.held += len(entries)
        self._follow(after, passed, parts)

    def _follow(self, after: HostState, passed: Sequence[_Row], parts: Sequence[_Row]) -> None:
        """What is ordered after a state was taken, on disk or in memory."""
        self.has_committed.set()
        self._die_if("AFTER", passed, parts)
        states = {drive.state.name for drive in after.drives.values()}
        if self.orders.get("kill_while") in states:
            os.kill(os.getpid(), signal.SIGKILL)
        for step, event, payload in passed:
            self._nudge(ROWS[step, event].to.name, payload)
        for _, event, to in parts:
            self._nudge(f"{to}-{event}", "")

    def _die_if(self, moment: str, passed: Sequence[_Row], parts: Sequence[_Row]) -> None:
        when, *row = self.orders.get("kill", ("", "", ""))
        rows = [[step.name, event] for step, event, _ in passed]
        rows += [[state, event] for state, event, _ in parts]
        if when == moment and row in rows:
            os.kill(os.getpid(), signal.SIGKILL)

    def tell(self, line: str) -> None:
        """Put a line into `told`, with the length of the disk's log, if there is one."""
        log = self.orders.get("log")
        length = Path(log).stat().st_size if log else 0
        with contextlib.suppress(OSError):  # the same as if it had died before it could
            os.write(self.told, f"{line} {length}\n".encode())

    def _passed(self, entries: Sequence[JournalEntry]) -> Iterator[tuple[Step, str, str]]:
        """Every transition that a commit is made of: (step, event, payload)."""
        steps = {key: payload.step for key, payload in self.state.payloads.items()}
        for entry in entries:
            payload = str(entry.detail.get("payload", ""))
            step = steps.get(payload, Step.GONE)
            if (step, entry.event) in ROWS:
                yield step, entry.event, payload
                steps[payload] = ROWS[step, entry.event].to

    def _components_passed(self, entries: Sequence[JournalEntry]) -> Iterator[tuple[str, str, str]]:
        """Every transition of the component: (state, event, next state)."""
        component = self.state.components.get(COMPONENT)
        state = component.state if component is not None else None
        for entry in entries:
            if state is not None and (state, entry.event) in COMPONENT_ROWS:
                to = COMPONENT_ROWS[state, entry.event]
                yield state.name, entry.event, to.name
                state = to

    def _nudge(self, at: str, payload: str) -> None:
        nudges = self.orders.get("nudge", [])
        if nudges and nudges[0][0] == at:
            self.make_happen(nudges.pop(0)[1], payload)

    def make_happen(self, what: str, payload: str = "") -> None:
        """Do one of the things that orders name; to the first payload unless another is given."""
        root = Path(self.orders["root"])
        problem = Problem("TEST", "made up by a test")
        lost = (Problem("WORKER_CRASH_LOOP", "made up by a test"),)
        key = payload or next(iter(self.state.payloads), "")
        match what:
            case "plug":
                (root / "slots" / OTHER).symlink_to(root / "drives" / OTHER)
            case "keep":
                self.kept += 1
                folders = Folders(root / "state")
                for line in kept.lines(kept.keep(folders, self.kept), folders.root):
                    self.tell(line)
            case "pull":
                (root / "slots" / SLOT).unlink()
                self.bus.emit(DriveRemoved(SLOT))
            case "send":
                self.bus.emit(PayloadSentAway(key, "mule", (problem,)))
            case "distrust":
                self.bus.emit(PayloadDistrusted(key, (problem,)))
            case "retry":
                self.bus.emit(RetryAsked(key))
            case "rollback":
                self.bus.emit(RollbackAsked(key, 1, 2))
            case "lost":
                self.bus.emit(WorkerFailed(COMPONENT, lost))
            case "exited":
                self.bus.emit(WorkerExited(COMPONENT, "made up by a test"))
            case "ready":
                described = self.state.components[COMPONENT].description
                self.bus.emit(WorkerReady(COMPONENT, described))
            case _:
                raise ValueError(what)


class Script:
    """Does one thing after the other."""

    def __init__(self, catalogue: DeadlyCatalogue, slots: Path) -> None:
        self._catalogue, self._slots = catalogue, slots

    async def run(self, script: Sequence[str]) -> None:
        for line in script:
            if line == "end now":
                return
            await self._until_settled()
            self._catalogue.tell(f"at {line}")
            what, *slots = line.split()
            match what:
                case "plug":
                    for slot in slots:
                        (self._slots / slot).symlink_to(self._slots.parent / "drives" / slot)
                case "pull":
                    for slot in slots:
                        (self._slots / slot).unlink(missing_ok=True)
                case "end":
                    return
                case _:
                    before = self._catalogue.state.payloads
                    self._catalogue.make_happen(what)
                    while self._catalogue.state.payloads == before:
                        await self._until_committed()
        await asyncio.Event().wait()  # it is killed, from inside or outside

    async def _until_settled(self) -> None:
        while not self._is_settled():
            await self._until_committed()

    async def _until_committed(self) -> None:
        """Wait for the next commit: nothing else changes the state."""
        self._catalogue.has_committed.clear()
        await self._catalogue.has_committed.wait()

    def _is_settled(self) -> bool:
        state = self._catalogue.state
        return (
            self._catalogue.is_scanned
            and {path.name for path in self._slots.iterdir()} == set(state.drives)
            and all(drive.state is DriveState.IDLE for drive in state.drives.values())
            and all(payload.step in _AT_REST for payload in state.payloads.values())
        )


async def main(orders: dict[str, Any]) -> None:
    with told_to_stop() as stop, watched_without_threads():
        await _main(orders, stop)


async def _main(orders: dict[str, Any], stop: asyncio.Event) -> None:
    root = Path(orders["root"])
    os.environ[MARK] = str(root)
    told = os.open(root / "told", os.O_CREAT | os.O_APPEND | os.O_WRONLY | os.O_CLOEXEC)
    folders = Folders(root / "state")
    held = await state_lock.lock(folders.root)
    bus = Bus(RULES)
    catalogue = await DeadlyCatalogue.open(folders.catalogue, HOST)
    assert isinstance(catalogue, DeadlyCatalogue)
    catalogue.orders, catalogue.bus, catalogue.told = orders, bus, told
    catalogue.has_committed = asyncio.Event()
    workers = Workers(HOST, bus.emit, timing=QUICK)
    executor = Executor(HOST, folders, workers, bus.emit, OPTIONS)
    manager = ComponentManager(catalogue, executor, bus)
    manager.add_source(SlotSource([root / "slots"]))
    running = asyncio.create_task(manager.run())
    waited: list[asyncio.Task[Any]] = [running, asyncio.create_task(stop.wait())]
    if "script" in orders:
        script = Script(catalogue, root / "slots")
        waited.append(asyncio.create_task(script.run(orders["script"])))
    done, _ = await asyncio.wait(waited, return_when=asyncio.FIRST_COMPLETED)
    for task in done:
        task.result()
    running.cancel()
    await asyncio.gather(running, return_exceptions=True)
    await workers.close()
    await catalogue.close()
    held.release()


if __name__ == "__main__":
    asyncio.run(main(json.loads(sys.argv[1])))

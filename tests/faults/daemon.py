"""A host's lifecycle in a process of its own, to be killed at a chosen commit.

The orders are one JSON object: `root`, and optionally `kill` ([when, step, event]: SIGKILL `BEFORE`
or `AFTER` the commit of that transition) and `nudge` ([step, what]: `pull` the drive, `retry` the
payload or report its worker `lost` as soon as that step was committed). The catalogue handed in at
the composition root does it; nothing that is shipped knows of it.
"""

from __future__ import annotations

import asyncio
import json
import os
import signal
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from nondum.host import events
from nondum.host.catalogue.catalogue import Catalogue
from nondum.host.catalogue.records import JournalEntry, Step
from nondum.host.catalogue.state import HostState
from nondum.host.drives.slots import SlotSource
from nondum.host.lifecycle.bus import Bus
from nondum.host.lifecycle.component_manager import ComponentManager
from nondum.host.lifecycle.executor import Executor
from nondum.host.lifecycle.folders import Folders, claim
from nondum.host.lifecycle.installation import InstallOptions
from nondum.host.transitions import TRANSITIONS
from nondum.host.workers import Timing, Workers
from nondum.sdk.errors import Problem

HOST = "spot"
SLOT = "a"
COMPONENT = "lamp"
ROWS = {(step, event.__name__): row for (step, event), row in TRANSITIONS.items()}


class DeadlyCatalogue(Catalogue):
    """Obeys orders as it commits."""

    orders: dict[str, Any]
    bus: Bus

    async def commit(self, after: HostState, entries: Sequence[JournalEntry]) -> None:
        passed = list(self._passed(entries))
        when, *row = self.orders.get("kill", ("", "", ""))
        is_deadly = any([step.name, event] == row for step, event, _ in passed)
        if is_deadly and when == "BEFORE":
            os.kill(os.getpid(), signal.SIGKILL)
        await super().commit(after, entries)
        if is_deadly:
            os.kill(os.getpid(), signal.SIGKILL)
        for step, event, payload in passed:
            self._nudge(ROWS[step, event].to, payload)

    def _passed(self, entries: Sequence[JournalEntry]) -> Iterator[tuple[Step, str, str]]:
        """Every transition that a commit is made of: (step, event, payload)."""
        steps = {key: payload.step for key, payload in self.state.payloads.items()}
        for entry in entries:
            payload = str(entry.detail.get("payload", ""))
            step = steps.get(payload, Step.GONE)
            if (step, entry.event) in ROWS:
                yield step, entry.event, payload
                steps[payload] = ROWS[step, entry.event].to

    def _nudge(self, step: Step, payload: str) -> None:
        at, what = self.orders.get("nudge", ("", ""))
        if at != step.name:
            return
        del self.orders["nudge"]
        match what:
            case "pull":
                (Path(self.orders["root"]) / "slots" / SLOT).unlink()
                self.bus.emit(events.DriveRemoved(SLOT))
            case "send":
                problem = Problem("PLACED_ELSEWHERE", "made up by a test")
                self.bus.emit(events.PayloadSentAway(payload, "mule", (problem,)))
            case "retry":
                self.bus.emit(events.RetryAsked(payload))
            case "lost":
                problem = Problem("WORKER_CRASH_LOOP", "made up by a test")
                self.bus.emit(events.WorkerFailed(COMPONENT, (problem,)))


async def main(orders: dict[str, Any]) -> None:
    root = Path(orders["root"])
    folders = Folders(root / "state")
    claim(folders)
    bus = Bus()
    catalogue = await DeadlyCatalogue.open(folders.catalogue, HOST)
    assert isinstance(catalogue, DeadlyCatalogue)
    catalogue.orders, catalogue.bus = orders, bus
    workers = Workers(HOST, bus.emit, timing=Timing(startup_s=2.0))
    options = InstallOptions(allow_unsigned=True)
    executor = Executor(HOST, folders, workers, bus.emit, options)
    manager = ComponentManager(catalogue, executor, bus)
    manager.add_source(SlotSource([root / "slots"]))
    await manager.run()


if __name__ == "__main__":
    asyncio.run(main(json.loads(sys.argv[1])))

"""Usage checks: every two seconds, what each worker uses is looked at, sooner if the disk fills."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Callable, Iterable

from nondum.host.core.events.event import Emit
from nondum.host.core.events.workers import WorkerStrained
from nondum.host.workers.worker import Worker

GLANCE_S = 0.5
"""Between two looks at the disk's free space: one system call."""
FLOOD_BYTES = 64 * 1024 * 1024
"""Disk space that is used up between two checks before the next one begins at once."""


class UsageChecks:
    """Looks at workers. `run` it."""

    def __init__(
        self, workers: Callable[[], Iterable[Worker]], emit: Emit, period_s: float
    ) -> None:
        self._workers, self._emit, self._period_s = workers, emit, period_s

    async def run(self) -> None:
        """Look until cancelled: workers that use too much are ended, strains are told."""
        while True:
            await self._due()
            for worker in tuple(self._workers()):
                for problem in await worker.look():
                    self._emit(WorkerStrained(worker.spec.component, (problem,)))

    async def _due(self) -> None:
        loop, before = asyncio.get_running_loop(), self._free_bytes()
        until_s = loop.time() + self._period_s
        while (left_s := until_s - loop.time()) > 0:
            await asyncio.sleep(min(GLANCE_S, left_s))
            free = self._free_bytes()
            if before - free > FLOOD_BYTES:
                return
            before = max(before, free)

    def _free_bytes(self) -> int:
        """Of the disk that scratch folders are on: all are on one."""
        for worker in self._workers():
            try:
                disk = os.statvfs(worker.spec.scratch)
            except OSError:  # it is just being removed
                continue
            return disk.f_bavail * disk.f_frsize
        return 0

"""Work that can wait: done while nothing else is, given up at once for what cannot wait."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Awaitable, Callable, Iterator
from typing import Any, TypeVar

_R = TypeVar("_R")

SETTLED_S = 1.0
"""How long nothing must have happened before work is begun that can wait."""


class IdleScheduler:
    """Knows whether anything urgent is being done. One piece of other work at a time."""

    def __init__(self, *, settled_s: float = SETTLED_S) -> None:
        self._settled_s = settled_s
        self._urgent = 0
        self._turn = asyncio.Lock()
        self._changed = asyncio.Event()

    @contextlib.contextmanager
    def urgent(self) -> Iterator[None]:
        """Something is done that cannot wait; what can is cancelled, and begun again later."""
        self._urgent += 1
        self._changed.set()
        try:
            yield
        finally:
            self._urgent -= 1
            self._changed.set()

    async def run(self, work: Callable[[], Awaitable[_R]]) -> _R:
        """Do work once it is quiet, again and again until nothing comes between."""
        async with self._turn:
            while True:
                await self._settle()
                task = asyncio.ensure_future(work())
                try:
                    if await self._undisturbed(task):
                        return task.result()
                finally:
                    task.cancel()
                    await asyncio.wait([task])

    async def _settle(self) -> None:
        """Wait until nothing urgent has been done for a while."""
        while True:
            self._changed.clear()
            if self._urgent:
                await self._changed.wait()
                continue
            try:
                await asyncio.wait_for(self._changed.wait(), self._settled_s)
            except TimeoutError:
                return

    async def _undisturbed(self, task: asyncio.Future[_R]) -> bool:
        """Wait for a task's end, or for something urgent; answer whether it ended."""
        disturbed = asyncio.ensure_future(self._changed.wait())
        waited: list[asyncio.Future[Any]] = [task, disturbed]
        try:
            await asyncio.wait(waited, return_when=asyncio.FIRST_COMPLETED)
            return task.done()
        finally:
            disturbed.cancel()

"""Keyed queues: one piece of work at a time for each key, in the order given."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any, TypeVar

_R = TypeVar("_R")
Work = Callable[[], Awaitable[None]]


class KeyedQueues:
    """Work in progress by key."""

    def __init__(self) -> None:
        self._tasks: dict[str, list[asyncio.Task[None]]] = {}

    def add(self, key: str, work: Work, *, instead: bool = False) -> None:
        """Do `work` when what is before it in its lane has ended; `instead`: cancel that first."""
        before = list(self._tasks.get(key, ()))
        if instead:
            for task in before:
                task.cancel()
        task = asyncio.create_task(_after(before, work))
        self._tasks.setdefault(key, []).append(task)
        task.add_done_callback(lambda done: self._forget(key, done))

    async def close(self) -> None:
        """Give up everything, and wait until it has ended."""
        tasks = [task for queue in self._tasks.values() for task in queue]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    def _forget(self, key: str, task: asyncio.Task[None]) -> None:
        self._tasks[key].remove(task)
        if not self._tasks[key]:
            del self._tasks[key]


async def _after(before: list[asyncio.Task[None]], work: Work) -> None:
    if before:
        await asyncio.wait(before)
    await work()


async def in_thread(function: Callable[..., _R], *arguments: Any) -> _R:
    """Run blocking code in a thread; cancelled, wait for its end all the same."""
    work = asyncio.ensure_future(asyncio.to_thread(function, *arguments))
    try:
        return await asyncio.shield(work)
    except asyncio.CancelledError:
        await asyncio.wait([work])
        raise

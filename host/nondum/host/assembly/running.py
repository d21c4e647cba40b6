"""Runs what runs as long as a host, until it is told to stop."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any


async def when(event: asyncio.Event, function: Callable[[], None]) -> None:
    """Call a function once an event is set."""
    await event.wait()
    function()


async def run_until(stop: asyncio.Event, *parts: Coroutine[Any, Any, None]) -> None:
    """Run all parts until one fails or `stop` is set; then let all of them end."""
    async with asyncio.TaskGroup() as group:
        tasks = [group.create_task(part) for part in parts]
        group.create_task(_cancel_when(stop, tasks))


async def _cancel_when(stop: asyncio.Event, tasks: list[asyncio.Task[None]]) -> None:
    await stop.wait()
    for task in tasks:
        task.cancel()

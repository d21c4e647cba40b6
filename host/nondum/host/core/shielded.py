"""Waiting for what must be seen to its end."""

from __future__ import annotations

import asyncio
from typing import Any


async def until_done(task: asyncio.Task[Any]) -> None:
    """Wait for a task that ends soon; a cancellation of the caller is raised afterwards."""
    cancelled: asyncio.CancelledError | None = None
    while not task.done():
        try:
            await asyncio.wait([task])
        except asyncio.CancelledError as error:
            cancelled = error
    if cancelled is not None:
        raise cancelled

"""What is new on a host, for those who watch it: that something has happened, and how far payloads
have come."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from typing import Any

from nondum.host.core.events.drives import DriveQueued
from nondum.host.core.events.event import Event
from nondum.host.core.events.payloads import ProgressMade
from nondum.sdk.frozen import frozen

PROGRESS_S = 0.1
"""Progress within one phase is told no more often: a view costs more than a step of copying."""


@frozen
class Progress:
    """How far a payload is within the step that it is at."""

    phase: str
    done: int
    total: int

    def to_dict(self) -> dict[str, Any]:
        """Plain data for people's tools.

        >>> Progress("copy", 1, 4).to_dict()
        {'phase': 'copy', 'done': 1, 'total': 4, 'fraction': 0.25}
        """
        fraction = min(1.0, self.done / self.total) if self.total else 0.0
        return {
            "phase": self.phase,
            "done": self.done,
            "total": self.total,
            "fraction": round(fraction, 3),
        }


class News:
    """Listens to the bus. Its methods run on the loop."""

    def __init__(self, now_s: Callable[[], float] = time.monotonic) -> None:
        self.version = 0
        """Rises with everything that happened."""
        self._now_s = now_s
        self._next = asyncio.Event()
        self._progress: dict[str, Progress] = {}
        self._progress_told_s = float("-inf")
        self._ahead: dict[str, int] = {}

    def on_event(self, event: Event) -> None:
        """Take in what has happened. A step that a payload comes to ends its progress."""
        if isinstance(event, ProgressMade):
            self._on_progress(event)
        elif isinstance(event, DriveQueued):
            self._ahead[event.drive] = event.ahead
            self._tell()
        elif event.JOURNALLED:
            payload = getattr(event, "payload", None)  # of those events that are about one
            self._progress.pop(str(payload), None)
            self._ahead.pop(str(getattr(event, "drive", None)), None)
            self._tell()

    def look_again(self) -> None:
        """What is shown is another, whatever the reason: time, for instance."""
        self._tell()

    def progress(self, payload: str) -> Progress | None:
        """How far the payload of that key is within its step, where that is known."""
        return self._progress.get(payload)

    def ahead(self, drive: str) -> int:
        """How many drives are looked through before that one."""
        return self._ahead.get(drive, 0)

    async def changed(self, since: int) -> int:
        """Wait until `version` is not `since`, and give it."""
        while self.version == since:
            await self._next.wait()
        return self.version

    def _on_progress(self, event: ProgressMade) -> None:
        before = self._progress.get(event.payload)
        now = self._progress[event.payload] = Progress(event.phase, event.done, event.total)
        is_new_phase = before is None or before.phase != now.phase
        if is_new_phase or self._now_s() - self._progress_told_s >= PROGRESS_S:
            self._progress_told_s = self._now_s()
            self._tell()

    def _tell(self) -> None:
        self.version += 1
        self._next.set()
        self._next = asyncio.Event()

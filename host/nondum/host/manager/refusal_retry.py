"""Tries refused payloads again once their cause is gone, and unread drives after a while."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Collection

from nondum.host.core.events.drives import DriveRetried
from nondum.host.core.events.event import Emit
from nondum.host.core.events.payloads import RetryAsked
from nondum.host.core.records.snapshot import Snapshot
from nondum.host.core.records.step import Step
from nondum.host.lifecycle import retry_causes
from nondum.host.lifecycle.retry_causes import Amounts, Unread, Waiting

LOOK_S = 2.0
"""Between two looks at what the host has, while a payload waits for it."""
_AT_WORK = frozenset({Step.ACTIVE, Step.SUPERSEDED})


class RefusalRetry:
    """Looks while `run` runs, and only while something waits. By the time of the event loop."""

    def __init__(
        self,
        snapshot: Callable[[], Snapshot],
        amounts: Callable[[], Awaitable[Amounts]],
        emit: Emit,
        elsewhere: Callable[[], Collection[str]] = tuple,
    ) -> None:
        """`elsewhere` are keys of payloads that run on peers meanwhile."""
        self._snapshot, self._amounts, self._emit = snapshot, amounts, emit
        self._elsewhere = elsewhere
        self._waiting: dict[str, Waiting] = {}
        self._unread: dict[str, Unread] = {}

    async def run(self) -> None:
        """Look until cancelled."""
        while True:
            await self._look()
            await asyncio.sleep(LOOK_S)

    async def _look(self) -> None:
        snapshot = self._snapshot()
        now_s = asyncio.get_running_loop().time()
        self._unread, again = retry_causes.drives_due(self._unread, snapshot.drives, now_s)
        for drive in again:
            self._emit(DriveRetried(drive, "the helper may answer now"))
        refused = tuple(retry_causes.waits(snapshot, frozenset(self._elsewhere())))
        if not refused and not self._waiting:
            return
        at_work = {payload.key for payload in snapshot.payloads if payload.step in _AT_WORK}
        self._waiting, due = retry_causes.due(
            self._waiting, refused, at_work, await self._amounts(), now_s
        )
        for one in due:
            self._emit(RetryAsked(one.payload, one.why))

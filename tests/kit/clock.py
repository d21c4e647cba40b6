"""A clock that a test advances: the time of its event loop.

Product code on the loop reads time by `loop.time()`, `asyncio.sleep` and `asyncio.timeout` only.
So a test that asks for the fixture `clock` decides when a second passes, however slow the machine:

    async def test_worker_that_is_silent_hangs(clock: VirtualClock) -> None:
        ...
        await clock.advance(timing.heartbeat_s * timing.missed)

Input and output are real: sockets, pipes and ends of processes arrive as they do otherwise.
"""

from __future__ import annotations

import asyncio
from typing import Any


class VirtualClock(asyncio.SelectorEventLoop):
    """An event loop whose time stands still until it is advanced."""

    _now_s = 1_000.0
    _scheduled: list[asyncio.TimerHandle]
    """asyncio's own heap of timers, soonest first."""
    _ready: Any
    """asyncio's own queue of what runs next."""

    def time(self) -> float:
        """Seconds of virtual time."""
        return self._now_s

    async def advance(self, seconds: float) -> None:
        """Let time pass. Timers fire in their order; what each starts runs until it waits."""
        assert seconds >= 0, "time does not run backwards"
        end_s = self._now_s + seconds
        await self.settle()
        while (due_s := self._next_timer_s()) is not None and due_s <= end_s:
            self._now_s = max(self._now_s, due_s)
            await self.settle()
        self._now_s = end_s
        await self.settle()

    async def settle(self) -> None:
        """Run all tasks until each waits for input, a thread or a timer."""
        await asyncio.sleep(0)
        while self._ready:  # noqa: ASYNC110  # no event tells that nothing is left to run
            await asyncio.sleep(0)

    def _next_timer_s(self) -> float | None:
        return min((t.when() for t in self._scheduled if not t.cancelled()), default=None)

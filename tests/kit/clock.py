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
import time
from collections.abc import Awaitable
from typing import Any, TypeVar

_T = TypeVar("_T")


_PAUSE_S = 0.005
"""Between two steps, for input from other processes."""


class VirtualClock(asyncio.SelectorEventLoop):
    """An event loop whose time stands still until it is advanced."""

    _now_s = 1_000.0
    _is_settling = False
    _scheduled: list[asyncio.TimerHandle]
    """asyncio's own heap of timers, soonest first."""
    _clock_resolution: float
    """asyncio's own: it fires timers early by up to as much, in seconds."""
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

    async def stand_still(self, seconds: float) -> None:
        """Let time pass in which the loop does nothing, as when one of its callbacks blocks: what
        was due meanwhile is late, and what has come meanwhile was not read."""
        self.skip(seconds)
        await self.settle()

    def skip(self, seconds: float) -> None:
        """Let time pass in the midst of a callback."""
        assert seconds >= 0, "time does not run backwards"
        self._now_s += seconds

    async def advance_until(self, awaited: Awaitable[_T], step_s: float = 0.1) -> _T:
        """Let time pass in steps until something has happened that takes input, too: the end of a
        process that is given a grace, say. Between the steps there is time for that."""
        task = asyncio.ensure_future(awaited)
        try:
            while not task.done():
                await self.advance(step_s)
                await asyncio.to_thread(time.sleep, _PAUSE_S)
            return await task
        finally:
            task.cancel()

    async def settle(self) -> None:
        """Run all tasks until each waits for input, a thread or a timer."""
        assert not self._is_settling, "only one task at a time may let time pass"
        self._is_settling = True
        try:
            await asyncio.sleep(0)
            while self._ready:  # noqa: ASYNC110  # no event tells that nothing is left to run
                await asyncio.sleep(0)
        finally:
            self._is_settling = False

    def _run_once(self) -> None:
        """Run what is ready; a timer that is due within the clock's resolution fires at its time.

        asyncio fires it early by as much as that. What waits for the rest of a period would find
        some left, wait again, and spin, as time stands still meanwhile.
        """
        due_s = self._next_timer_s()
        if due_s is not None and self._now_s < due_s <= self._now_s + self._clock_resolution:
            self._now_s = due_s
        super()._run_once()  # type: ignore[misc]  # not in typeshed

    def _next_timer_s(self) -> float | None:
        return min((t.when() for t in self._scheduled if not t.cancelled()), default=None)

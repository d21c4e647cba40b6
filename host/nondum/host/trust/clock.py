"""Whether the wall clock may be believed: status says so while it may not, the journal once."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from datetime import UTC, datetime

from nondum.host.core.events.event import Emit
from nondum.host.core.events.trust import ClockDoubted, ClockRight
from nondum.sdk.errors import Problem
from nondum.wheelhouse.trust.judging import clock_unsure
from nondum.wheelhouse.trust.trust import Trust

LOOK_S = 5.0
"""Between two looks at it."""


def _utc() -> datetime:
    return datetime.now(UTC)


class ClockWatch:
    """Compares the clock with what is certainly past, by the active trust file."""

    def __init__(
        self, trust: Callable[[], Trust | None], emit: Emit, now: Callable[[], datetime] = _utc
    ) -> None:
        self._trust, self._emit, self._now = trust, emit, now

    @property
    def problems(self) -> tuple[Problem, ...]:
        """What is wrong with it now."""
        problem = clock_unsure(self._trust(), self._now())
        return () if problem is None else (problem,)

    async def run(self) -> None:
        """Tell whenever it is doubted, and when it is right again, until cancelled."""
        was_doubted = False
        while True:
            problems = self.problems
            if bool(problems) != was_doubted:
                was_doubted = bool(problems)
                self._emit(ClockDoubted(problems) if problems else ClockRight())
            await asyncio.sleep(LOOK_S)

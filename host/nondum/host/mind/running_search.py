"""The search for a plan that is under way, one at a time."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Coroutine
from typing import Any

from nondum.host.mind.situation import NoPlan, Outcome, Situation
from nondum.sdk.errors import Problem

log = logging.getLogger(__name__)


class RunningSearch:
    """Of one mind."""

    def __init__(self, wake: Callable[[], None]) -> None:
        """`wake` is called when a search has ended."""
        self._wake = wake
        self._task: asyncio.Task[Outcome] | None = None
        self._asked: Situation | None = None

    @property
    def is_running(self) -> bool:
        """Whether a plan is being searched for, or was found and not taken yet."""
        return self._task is not None

    def is_for(self, situation: Situation) -> bool:
        """Whether the search goes on, or would, in a situation."""
        return self._asked is not None and self._asked.is_like(situation)

    def start(self, situation: Situation, search: Coroutine[Any, Any, Outcome]) -> None:
        """Search in this situation, and no longer in that before."""
        self.cancel()
        self._asked = situation
        self._task = asyncio.create_task(search)
        self._task.add_done_callback(lambda _: self._wake())

    def cancel(self) -> None:
        """Search no longer."""
        if self._task is not None:
            self._task.cancel()
            self._task = self._asked = None

    def take(self) -> Outcome | None:
        """What the search came to, once; None: nothing yet."""
        if self._task is None or self._asked is None or not self._task.done():
            return None
        found = _outcome(self._task, self._asked)
        self._task = self._asked = None
        return found

    async def close(self) -> None:
        """Stop searching, and wait for that."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)


def _outcome(search: asyncio.Task[Outcome], asked: Situation) -> Outcome:
    """What a search came to; a fault in planning is contained, and told like a missing plan."""
    error = search.exception()
    if error is None:
        return search.result()
    log.error("a search for a plan failed", exc_info=error)
    problem = Problem("PLANNING_FAULT", f"planning failed: {type(error).__name__}: {error}")
    return NoPlan(asked, (problem,))

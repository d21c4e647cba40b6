"""All installed planners as one: they search side by side, and the first valid plan wins."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Sequence
from dataclasses import dataclass

from importlib_metadata import entry_points

from nondum.host.mind.planner_child import GROUP
from nondum.host.mind.planner_process import PlannerProcess
from nondum.planning.relaxed import quick_answer
from nondum.planning.validate import validate
from nondum.sdk.errors import PlannerFailed
from nondum.sdk.planner import AlreadyTrue, Answer, GaveUp, GroundTask, Plan, Unsolvable

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Found:
    """What came of a search."""

    answer: Answer
    planner: str
    """Who found it; empty where no search was needed, or nobody found anything."""
    took_s: float


class Planners:
    """A portfolio of planner processes. Asks them all; close it when done."""

    def __init__(self, processes: Sequence[PlannerProcess]) -> None:
        self._processes = tuple(processes)

    @classmethod
    def installed(cls, *, memory_mb: int) -> Planners:
        """Those that are installed in this host's own environment."""
        names = sorted({entry.name for entry in entry_points(group=GROUP)})
        return cls([PlannerProcess(name, memory_mb=memory_mb) for name in names])

    @property
    def names(self) -> tuple[str, ...]:
        """The planners' names."""
        return tuple(process.name for process in self._processes)

    async def warm(self) -> None:
        """Start every child. One that does not start is logged, and tried again when needed."""
        results = await asyncio.gather(
            *(process.warm() for process in self._processes), return_exceptions=True
        )
        for result in results:
            if isinstance(result, PlannerFailed):
                log.warning("%s", result)
            elif isinstance(result, BaseException):
                raise result

    async def plan(self, task: GroundTask, deadline_s: float) -> Found:
        """Search for a plan. Being cancelled cancels every search.

        The answer is a plan that was checked, a proof that there is none, or `GaveUp`.
        """
        started_s = time.monotonic()
        if (known := quick_answer(task)) is not None:
            return Found(known, "", time.monotonic() - started_s)
        searches = {
            asyncio.create_task(process.plan(task, deadline_s)): process.name
            for process in self._processes
        }
        try:
            answer, planner = await _first(searches, task)
        finally:
            for search in searches:
                search.cancel()
            await asyncio.gather(*searches, return_exceptions=True)
        return Found(answer, planner, time.monotonic() - started_s)

    async def close(self) -> None:
        """End every child."""
        await asyncio.gather(*(process.close() for process in self._processes))


async def _first(searches: dict[asyncio.Task[Answer], str], task: GroundTask) -> tuple[Answer, str]:
    """The first answer that settles the matter, and whose it is."""
    left: set[asyncio.Task[Answer]] = set(searches)
    reasons: list[str] = []
    while left:
        done, left = await asyncio.wait(left, return_when=asyncio.FIRST_COMPLETED)
        for search in sorted(done, key=lambda search: searches[search]):
            answer = _judged(search, task)
            if not isinstance(answer, GaveUp):
                return answer, searches[search]
            log.info("planner %s gave up: %s", searches[search], answer.why)
            reasons.append(f"{searches[search]}: {answer.why}")
    return GaveUp("; ".join(sorted(reasons)) or "no planner is installed"), ""


def _judged(search: asyncio.Task[Answer], task: GroundTask) -> Answer:
    """A search's answer, once checked; one that is worth nothing has given up."""
    try:
        answer = search.result()
    except PlannerFailed as error:
        return GaveUp(str(error))
    match answer:
        case Plan() if problems := validate(task, answer):
            return GaveUp(f"its plan is not valid: {problems[0].message}")
        case Unsolvable(proof) if proof != "exhausted":
            return GaveUp("it claims a proof that does not hold")
        case AlreadyTrue():
            return GaveUp("it says that the goal holds, which it does not")
    return answer

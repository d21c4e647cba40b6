"""All installed planners as one: they search side by side, and the first valid plan wins.

Robots choose between alternatives by cost, and small tasks are planned in no time: there the others
get a moment more, and the cheapest plan wins. (Over 30 small benchmark tasks the native planner,
which looks for cheaper plans by itself, gave the cheaper plan in 8, a greedy search in none; but
the greedy one is often first, by up to 0.1 s.)
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TypeAlias

from nondum.host.forking.fork_client import ForkClient
from nondum.host.mind.extension import planners
from nondum.host.mind.planner_process import PlannerProcess, planner_forks
from nondum.host.mind.planner_wire import Request, TaskText
from nondum.planning.ground.delete_relaxation import quick_answer
from nondum.planning.ground.plan_text import plan_of
from nondum.planning.search.validate import validate
from nondum.sdk.errors import PlannerFailed, Problem
from nondum.sdk.frozen import frozen
from nondum.sdk.planner import (
    AlreadyTrue,
    Answer,
    GaveUp,
    GroundTask,
    Plan,
    PlanText,
    Unsolvable,
)

SMALL = 1_000
"""Ground actions of a task for which a cheaper plan is waited for, …"""
CHEAPER_S = 0.3
"""… and how long."""

log = logging.getLogger(__name__)


@frozen
class Found:
    """What came of a search."""

    answer: Answer
    planner: str
    """The planner that found it; empty where no search was needed, or none found anything."""
    took_s: float


class Planners:
    """A portfolio of planner processes. Asks them all; close it when done."""

    def __init__(
        self, processes: Sequence[PlannerProcess], forks: ForkClient | None = None
    ) -> None:
        """`forks`, where the processes come from, is closed with them if it is given."""
        self._processes, self._forks = tuple(processes), forks

    @classmethod
    def installed(cls, *, memory_mb: int, temporary: Path | None = None) -> Planners:
        """Those that are installed in this host's own environment."""
        return cls.of(planners(), memory_mb=memory_mb, temporary=temporary)

    @classmethod
    def of(
        cls,
        found: Mapping[str, str],
        *,
        memory_mb: int,
        temporary: Path | None = None,
        stays: Callable[[], bool] | None = None,
    ) -> Planners:
        """Planners by name: `module:Class`; whether what they are forked from `stays`."""
        forks = planner_forks(stays=stays)
        processes = [
            PlannerProcess(name, found[name], forks, memory_mb=memory_mb, temporary=temporary)
            for name in sorted(found)
        ]
        return cls(processes, forks)

    @property
    def names(self) -> tuple[str, ...]:
        """The planners' names."""
        return tuple(process.name for process in self._processes)

    async def warm(self) -> None:
        """Have every planner imported, one after the other, where what has imported them stays."""
        if self._forks is not None and self._forks.stays:
            for process in self._processes:
                await process.warm()

    async def plan(
        self, task: GroundTask, deadline_s: float, text: TaskText | None = None
    ) -> Found:
        """Search for a plan. Being cancelled cancels every search.

        The answer is a plan that was checked, a proof that there is none, or `GaveUp`. `text` makes
        the same task's PDDL. It is called only for planners that ground by themselves, perhaps in
        another thread; without it, they give up.
        """
        loop = asyncio.get_running_loop()
        started_s = loop.time()
        if (known := quick_answer(task)) is not None:
            return Found(known, "", loop.time() - started_s)
        request = Request(task, text)
        searches = {
            asyncio.create_task(process.plan(request, deadline_s)): process.name
            for process in self._processes
        }
        try:
            answer, planner = await _best(searches, task)
        finally:
            for search in searches:
                search.cancel()
            await asyncio.gather(*searches, return_exceptions=True)
        return Found(answer, planner, loop.time() - started_s)

    async def close(self) -> None:
        """End every child."""
        await asyncio.gather(*(process.close() for process in self._processes))
        if self._forks is not None:
            await self._forks.close()


_Search: TypeAlias = asyncio.Task[Answer | PlanText]


async def _best(searches: Mapping[_Search, str], task: GroundTask) -> tuple[Answer, str]:
    """The answer that settles the matter, and whose it is."""
    reasons: list[str] = []
    plans: list[tuple[int, str, Plan]] = []
    left = set(searches)
    until_s: float | None = None
    while left and (done := await _done(left, until_s)):
        left -= done
        for search in sorted(done, key=lambda search: searches[search]):
            answer, name = _judged(search, task), searches[search]
            match answer:
                case Plan(cost=cost):
                    plans.append((cost, name, answer))
                case GaveUp(why):
                    log.info("planner %s gave up: %s", name, why)
                    reasons.append(f"{name}: {why}")
                case _ if not plans:
                    return answer, name
        if plans and until_s is None:
            more_s = CHEAPER_S if len(task.actions) <= SMALL else 0.0
            until_s = asyncio.get_running_loop().time() + more_s
    if plans:
        _, name, plan = min(plans, key=lambda found: (found[0], len(found[2].steps), found[1]))
        return plan, name
    return GaveUp("; ".join(sorted(reasons)) or "no planner is installed"), ""


async def _done(left: set[_Search], until_s: float | None) -> set[_Search]:
    """The searches that end next; none if nothing ends in time."""
    now_s = asyncio.get_running_loop().time()
    timeout_s = None if until_s is None else max(0.0, until_s - now_s)
    done, _ = await asyncio.wait(left, timeout=timeout_s, return_when=asyncio.FIRST_COMPLETED)
    return done


def _judged(search: _Search, task: GroundTask) -> Answer:
    """A search's answer, once checked; one that is worth nothing has given up."""
    try:
        answer = search.result()
    except PlannerFailed as error:
        return GaveUp(str(error))
    told = plan_of(task, answer) if isinstance(answer, PlanText) else answer
    match told:
        case Problem(message=message):
            return GaveUp(f"its plan is not valid: {message}")
        case Plan() if problems := validate(task, told):
            return GaveUp(f"its plan is not valid: {problems[0].message}")
        case Unsolvable(proof) if proof != "exhausted":
            return GaveUp("it claims a proof that does not hold")
        case AlreadyTrue():
            return GaveUp("it says that the goal holds, which it does not")
    return told

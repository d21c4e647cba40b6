"""What of a worker's use is too much: told to people, or the end of the worker. Pure; readings and
times are given.

Limits that the kernel keeps (cgroups, setrlimit(2)) hold whatever is found here; this says which
limit it was, and ends workers that beat against one instead of working.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from nondum.host.sandbox.cgroups import Usage
from nondum.host.workers import problems
from nondum.host.workers.spec import Limits, Timing
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen

REFUSALS = 1000
"""Processes and threads refused without a reading at which none was: it forks for its life."""
NEARLY = 0.9
"""Part of a limit at which people are told."""
SPIN_PART = 0.8
"""Of `spin_s`, one of its threads runs or waits for a processor: on a busy machine, it waits."""
SPARED = 3
"""Descriptors below the limit at which there are none left to work with."""


@frozen
class Reading:
    """What a worker uses at one moment."""

    at_s: float
    usage: Usage
    descriptors: int = 0
    """Most of any one of its processes."""
    scratch_bytes: int = 0
    wanted_s: Mapping[int, float] = field(default_factory=dict)
    """Thread → seconds that it has run or waited for a processor since it began."""
    held_bytes: int = 0
    """Memory that its processes hold, where no control group bounds that; else 0."""
    is_asked: bool = False
    """Whether a behaviour of its runs or a stream of its flows."""


@frozen
class Excess:
    """What is too much, by the code it is told with."""

    strains: tuple[Problem, ...] = ()
    """To be told; the worker goes on."""
    end: Problem | None = None
    """Why the worker is to be ended."""


@dataclass(slots=True)
class Watch:
    """One worker's readings, and what was told of it already."""

    component: str
    limits: Limits
    spin_s: float = Timing().spin_s
    """How long it may keep a processor busy with nothing to do."""
    _last: Reading | None = None
    _busy_since_s: float | None = None
    _refused_before: int = 0
    """Processes and threads that had been refused when last none was."""
    _told: set[str] = field(default_factory=set)

    def see(self, now: Reading) -> Excess:
        """Judge one more reading. A strain is told once, and again after it has passed."""
        last, self._last = self._last, now
        if last is None:
            return Excess()
        if (end := self._end(last, now)) is not None:
            return Excess(end=end)
        strains = {problem.code: problem for problem in self._strains(last, now)}
        fresh = tuple(p for code, p in strains.items() if code not in self._told)
        self._told = set(strains)
        return Excess(fresh)

    def _end(self, last: Reading, now: Reading) -> Problem | None:
        is_beyond = now.held_bytes > self.limits.memory_mb * problems.MEGABYTE
        if is_beyond or now.usage.oom_kills > last.usage.oom_kills:
            return problems.out_of_memory(self.component, self.limits.memory_mb)
        if now.usage.refused_tasks == last.usage.refused_tasks:
            self._refused_before = now.usage.refused_tasks
        if now.usage.refused_tasks - self._refused_before >= REFUSALS:
            return problems.too_many_tasks(self.component, self.limits.tasks)
        full = self.limits.descriptors - SPARED
        if now.descriptors >= full and last.descriptors >= full:
            return problems.too_many_descriptors(self.component, self.limits.descriptors)
        if now.scratch_bytes > self.limits.scratch_mb * problems.MEGABYTE:
            return problems.scratch_full(self.component, self.limits.scratch_mb)
        return None

    def _strains(self, last: Reading, now: Reading) -> Iterator[Problem]:
        if now.usage.refused_tasks > last.usage.refused_tasks:
            yield problems.too_many_tasks(self.component, self.limits.tasks)
        if now.descriptors >= self.limits.descriptors * NEARLY:
            yield problems.too_many_descriptors(self.component, self.limits.descriptors)
        if now.scratch_bytes >= self.limits.scratch_mb * problems.MEGABYTE * NEARLY:
            yield problems.scratch_full(self.component, self.limits.scratch_mb)
        if self._is_spinning(last, now):
            yield problems.spinning(self.component, self.spin_s)

    def _is_spinning(self, last: Reading, now: Reading) -> bool:
        most = min(1.0, self.limits.processors or 1.0) * SPIN_PART
        wanted_s = max(
            (wanted_s - last.wanted_s.get(task, 0.0) for task, wanted_s in now.wanted_s.items()),
            default=0.0,
        )
        if now.is_asked or wanted_s < most * (now.at_s - last.at_s):
            self._busy_since_s = None
        elif self._busy_since_s is None:
            self._busy_since_s = last.at_s
        return self._busy_since_s is not None and now.at_s - self._busy_since_s >= self.spin_s

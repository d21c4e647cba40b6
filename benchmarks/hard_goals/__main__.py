"""Goals that are too much for any planner: is there an answer in time, and within the memory given?

    python -m benchmarks.hard_goals [--limit-s 10] [--repeats 1]

Problems of ten families, each in sizes from small to hopeless, are read, grounded and given to
nondum's planners as a host does it, every one in a child with its own limit of memory. An answer is
a plan that was checked, a proof that there is none, a refusal with its code, or that time or memory
ran out. Writes docs/reliability/planning.md.
"""

from __future__ import annotations

import argparse
import asyncio
import re
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.hard_goals.problems import FAMILIES, Texts
from benchmarks.measuring import machine, table

from nondum.host.mind.extension import GROUP
from nondum.host.mind.planner_process import PlannerProcess, planner_forks
from nondum.host.mind.planners import Planners
from nondum.planning.ground.bounds import INSTANCES_LIMIT
from nondum.planning.ground.ground import ground
from nondum.sdk.errors import NondumError
from nondum.sdk.planner import AlreadyTrue, Answer, GaveUp, Plan, Unsolvable
from nondum_pddl_workbench import standalone

PAGE = Path(__file__).parents[2] / "docs/reliability/planning.md"
MEMORY_MB = 512
"""What a host gives each planner, unless it is told otherwise."""
LOOK_S = 0.02
LATE_S = 2.0
"""What reading and grounding may take beside the search."""


@dataclass(frozen=True, slots=True)
class Row:
    """What became of one problem."""

    family: str
    size: int
    answer: str
    """A word, or the code of a refusal."""
    seconds: float
    """From the texts to the answer."""
    memory_mb: float
    """The most that any planner's process had in memory."""


def main() -> None:
    """Ask everything, write the page."""
    parser = argparse.ArgumentParser("python -m benchmarks.hard_goals", description=__doc__)
    parser.add_argument("--limit-s", type=float, default=10.0, help="what a search may take")
    parser.add_argument("--only", help="family")
    options = parser.parse_args()
    rows = asyncio.run(_asked(options.limit_s, options.only))
    if not options.only:
        PAGE.write_text(_page(rows, options.limit_s), encoding="utf-8")


async def _asked(limit_s: float, only: str | None) -> list[Row]:
    from importlib_metadata import entry_points

    found = {entry.name: entry.value for entry in entry_points(group=GROUP)}
    forks = planner_forks()
    processes = [PlannerProcess(n, found[n], forks, memory_mb=MEMORY_MB) for n in sorted(found)]
    planners = Planners(processes, forks)
    await planners.warm()
    rows = []
    try:
        for family, (make, sizes) in FAMILIES.items():
            for size in sizes if only in (None, family) else ():
                row = await _one(planners, processes, family, size, make(size), limit_s)
                rows.append(row)
                print(row, flush=True)
    finally:
        await planners.close()
    return rows


async def _one(
    planners: Planners,
    processes: Sequence[PlannerProcess],
    family: str,
    size: int,
    texts: Texts,
    limit_s: float,
) -> Row:
    most: dict[int, int] = {}
    watching = asyncio.create_task(_watch(processes, most))
    begun_s = time.monotonic()
    try:
        told = _word(await _answer(planners, texts, limit_s))
    except NondumError as refused:
        told = refused.code
    took_s = time.monotonic() - begun_s
    watching.cancel()
    await asyncio.gather(watching, return_exceptions=True)
    return Row(family, size, told, took_s, max(most.values(), default=0) / 1024)


async def _answer(planners: Planners, texts: Texts, limit_s: float) -> Answer:
    domain, problem = texts
    read = await asyncio.to_thread(standalone.load, domain, "domain", problem, "problem")
    task = await asyncio.to_thread(
        ground, read.merged, read.facts, read.goal, limit=INSTANCES_LIMIT
    )
    return (await planners.plan(task, limit_s)).answer


async def _watch(processes: Sequence[PlannerProcess], most: dict[int, int]) -> None:
    """Keep the most that each planner's process had, in KB (proc_pid_status(5))."""
    while True:
        for pid in [process.pid for process in processes if process.pid is not None]:
            most[pid] = max(most.get(pid, 0), _resident_kb(pid))
        await asyncio.sleep(LOOK_S)


def _resident_kb(pid: int) -> int:
    try:
        status = Path(f"/proc/{pid}/status").read_text(encoding="ascii")
    except OSError:  # it has just been killed
        return 0
    found = re.search(r"VmRSS:\s+(\d+)", status)
    return int(found[1]) if found else 0


def _word(answer: Answer) -> str:
    match answer:
        case Plan():
            return "a plan"
        case AlreadyTrue():
            return "true already"
        case Unsolvable():
            return "proved to have none"
        case GaveUp():
            return "time or memory ran out"


def _page(rows: Sequence[Row], limit_s: float) -> str:
    late = sum(row.seconds > limit_s + LATE_S for row in rows)
    header = ("problems", "sizes", "answers", "longest", "most memory")
    return f"""\
# Goals that are too much

Written by `python -m benchmarks.hard_goals`. Problems of ten families, from small to hopeless, are
read, grounded, and given to all planners at once as a host does it: each planner in a process of
its own with {MEMORY_MB} MB of address space, and {limit_s:g} s to search. *Longest* is from the
texts to the answer: reading and grounding, which have a limit of work and not of time, come on top.
*Most memory* is that of the greediest planner.

{table(header, list(_lines(rows)))}

{len(rows)} problems, {len(rows)} answers; more than {LATE_S:g} s over the limit: {late}.

Machine: {machine()}.
"""


def _lines(rows: Sequence[Row]) -> Iterator[tuple[str, ...]]:
    for family in FAMILIES:
        own = [row for row in rows if row.family == family]
        words = dict.fromkeys(row.answer for row in own)
        counts = ", ".join(f"{sum(row.answer == w for row in own)} {w}" for w in words)
        yield (
            family,
            f"{own[0].size}-{own[-1].size}",
            counts,
            f"{max(row.seconds for row in own):.1f} s",
            f"{max(row.memory_mb for row in own):.0f} MB",
        )


if __name__ == "__main__":
    main()

"""Workers that misbehave, in thirteen ways, beside some that do not: `python -m
benchmarks.misbehaviour [--times 40]`. Needs root (cgroups). Writes docs/reliability/workers.md.
"""

from __future__ import annotations

import argparse
import asyncio
from collections.abc import Callable, Sequence
from pathlib import Path

from benchmarks.measuring import Spread, machine, table
from benchmarks.misbehaviour.measurement import Decisions, Round, misbehave
from benchmarks.misbehaviour.scene import LIMITS, Scene, scene
from benchmarks.misbehaviour.ways import WAYS, Way
from benchmarks.misbehaviour.windows import Window, p99, window

from nondum.host.service import malloc
from nondum.host.workers.boxed import Boxed
from nondum.host.workers.confinement import Confinement
from nondum.host.workers.held import Held
from nondum.host.workers.unconfined import Unconfined

PAGE = Path(__file__).parents[2] / "docs/reliability/workers.md"
REPEATS = 4
"""Percentiles that are compared: the rounds of a way are put together. One that is ended at once
leaves a dozen calls."""
LONG = 5
"""A way that takes seconds is measured in a fifth of the rounds."""

Windows = tuple[Sequence[Window], Sequence[Window], Sequence[Window]]
"""Before, meanwhile, and while a plain process did the same."""
LAST_FRAME_S = 0.05
"""A frame that was made by then has been seen."""
CONFINEMENTS: dict[str, Callable[[], Confinement]] = {
    "sandboxed": lambda: Boxed("bwrap"),
    "restricted": Held,
    "none": Unconfined,
}
TOLD_HEAD = ["it …", "code", "told after s", "gone after another s"]
PEACE_HEAD = [
    "it …",
    "calls before, ms",
    "meanwhile",
    "times",
    "slowest",
    "plain process",
    "times",
    "frames before, ms",
    "meanwhile",
    "times",
    "plain process",
    "times",
    "lost",
]
PAGE_TEXT = """# Workers that misbehave

Written by `python -m benchmarks.misbehaviour`. A third worker misbehaves beside two good ones: each
way {times} times, those that take seconds {fewer} times, at confinement level `{level}`, with
{memory_mb} MB of memory, {tasks} tasks, {descriptors} descriptors, {scratch_mb} MB of scratch and
one processor. *Told* is when the host acts on it or says so, *gone* when nothing of the worker is
left; medians (lowest-highest). The good workers are the same processes from the first row to the
last, and so is the daemon.

{told}

A worker that hangs is found by its heartbeat, which it sends every 2 s and of which it may miss
three. What it uses is looked at every 2 s, and as soon as 64 MB of disk have gone. It is started
again after 1, 2 and 4 s, and not a fourth time within a minute.

## What the others notice

Both good workers are called in turn, every 2 ms, and one sends the other 100 images of 76,800 bytes
a second. 99th percentiles of what a call took and of a frame's way from one to the other, in
milliseconds: just before, while the worker misbehaves, and while a plain process does the
same for as long, in a control group with the same limits, started by hand and known to no host:
what that does to the others is this machine's kernel. The rounds of a
way are put together to {repeats} percentiles; medians of these (lowest-highest), *times* is pair by
pair. *Slowest* is the slowest call of all rounds. *Lost* counts the frames that were made and not
seen, in all rounds; frames that are lost beside the plain process are not counted. The aim is 1.2
times and no frame lost.

{peace}

Machine: {machine}.
"""


def told_row(way: Way, rounds: Sequence[Round]) -> list[str]:
    """When the host knew, and when it was over."""
    return [
        way.name,
        ", ".join(sorted({f"`{r.code}`" for r in rounds})),
        f"{Spread(tuple(r.told_s for r in rounds)):.2f}",
        f"{Spread(tuple(r.gone_s for r in rounds)):.2f}" if way.is_ended else "goes on",
    ]


def peace_row(way: Way, windows: Windows) -> list[str]:
    """What the good ones noticed of it."""
    calls, frames = _columns(windows, "calls_ms"), _columns(windows, "frames_ms")
    _, meanwhile, _ = windows
    slowest = f"{max((c for w in meanwhile for c in w.calls_ms), default=0.0):.1f}"
    return [way.name, *calls[:3], slowest, *calls[3:], *frames, str(sum(w.lost for w in meanwhile))]


async def _windows(made: Scene, rounds: Sequence[Round]) -> Windows:
    """Looked at when all rounds are over: it takes the loop that the good ones' answers come to."""
    await asyncio.sleep(LAST_FRAME_S)
    calls, frames = tuple(made.calls), made.frames()
    before, meanwhile, plainly = (
        [window(calls, frames, span) for span in spans if span is not None]
        for spans in zip(*((r.before, r.meanwhile, r.plainly) for r in rounds), strict=True)
    )
    made.calls.clear()
    return before, meanwhile, plainly


def _columns(windows: Windows, kind: str) -> list[str]:
    """Before; meanwhile and as a part of that; the plain process and as a part of that."""
    before, *others = (
        [p99(getattr(one, kind) for one in some[at::REPEATS]) for at in range(REPEATS)]
        for some in windows
    )
    columns = [_spread(before)]
    for other in others:
        parts = [a / b if a and b else None for a, b in zip(other, before, strict=True)]
        columns += [_spread(other), _spread(parts)]
    return columns


def _spread(values: Sequence[float | None]) -> str:
    known = tuple(value for value in values if value is not None)
    return f"{Spread(known):.1f}" if known else "-"


async def main(times: int, confinement: Confinement) -> tuple[str, str]:
    """Have all of it happen, and answer the two tables."""
    malloc.keep_what_is_loaded()  # as a daemon does
    decisions = Decisions()
    told, peace = [], []
    async with scene(confinement) as made:
        pids = made.workers.pids()
        for way in WAYS:
            often = times // LONG if way.is_long else times
            rounds = [await misbehave(made, way, decisions) for _ in range(often)]
            told.append(told_row(way, rounds))
            peace.append(peace_row(way, await _windows(made, rounds)))
            print(" | ".join((*told[-1], *peace[-1][1:])), flush=True)
        assert made.workers.pids() == pids, "the good ones are those of the beginning"
    return table(TOLD_HEAD, told), table(PEACE_HEAD, peace)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--times", type=int, default=40)
    parser.add_argument("--level", choices=CONFINEMENTS, default="sandboxed")
    chosen = parser.parse_args()
    told, peace = asyncio.run(main(chosen.times, CONFINEMENTS[chosen.level]()))
    PAGE.write_text(
        PAGE_TEXT.format(
            times=chosen.times,
            fewer=chosen.times // LONG,
            level=chosen.level,
            memory_mb=LIMITS.memory_mb,
            tasks=LIMITS.tasks,
            descriptors=LIMITS.descriptors,
            scratch_mb=LIMITS.scratch_mb,
            repeats=REPEATS,
            told=told,
            peace=peace,
            machine=machine(),
        ),
        encoding="utf-8",
    )

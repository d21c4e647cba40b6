"""One way to misbehave, once: by a worker, and by a plain process for as long."""

from __future__ import annotations

import asyncio
import os
import time
from collections.abc import Callable
from dataclasses import dataclass

from benchmarks.misbehaviour.plain import plain
from benchmarks.misbehaviour.scene import HOST, Scene
from benchmarks.misbehaviour.ways import Way
from benchmarks.misbehaviour.windows import Span

from nondum.host.workers.worker import Worker
from nondum.sdk.errors import Problem

BASELINE_S = 0.6
SETTLED_S = 0.3


@dataclass(frozen=True)
class Round:
    """What one misbehaviour led to."""

    told_s: float
    """From its beginning until it was told or acted upon."""
    gone_s: float
    """From there until nothing of the worker was left; 0 where it goes on."""
    code: str
    before: Span
    meanwhile: Span
    plainly: Span | None
    """In which a plain process did the same."""


class Decisions:
    """When it was decided that the guest ends: `Worker.end`, watched, in this process only."""

    def __init__(self) -> None:
        self.at_s: list[float] = []
        Worker.end = self._watched(Worker.end)  # type: ignore[method-assign, assignment]

    def _watched(
        self, end: Callable[[Worker, Problem, float], None]
    ) -> Callable[[Worker, Problem, float], None]:
        def deciding(worker: Worker, problem: Problem, term_s: float = 0.0) -> None:
            if worker.spec.component == "guest":
                self.at_s.append(time.monotonic())
            end(worker, problem, term_s)

        return deciding


async def misbehave(made: Scene, way: Way, decisions: Decisions) -> Round:
    """Have it happen once."""
    await made.start("guest", way.body)
    await asyncio.sleep(SETTLED_S)
    quiet_s = time.monotonic()
    await asyncio.sleep(BASELINE_S)
    made.events.clear()
    decisions.at_s.clear()
    begun_s = time.monotonic()
    call = made.workers.behave("guest", "do", {"u": f"{HOST}__guest__it"})
    if way.signals is not None:
        os.kill(made.workers.pids()["guest"], way.signals)
    if way.halts:
        await asyncio.sleep(0.1)
        call.halt()
    at_s, code = await made.until_told(begun_s, way.codes)
    told_s = decisions.at_s[0] if decisions.at_s and way.is_ended else at_s
    await made.workers.stop("guest", 0.5)
    return Round(
        told_s=told_s - begun_s,
        gone_s=at_s - told_s if way.is_ended else 0.0,
        code=code,
        before=Span(quiet_s, begun_s),
        meanwhile=Span(begun_s, at_s),
        plainly=await _plainly(made, way, at_s - begun_s) if way.has_plain else None,
    )


async def _plainly(made: Scene, way: Way, long_s: float) -> Span:
    async with plain(way, made.folder / "plain", made.cgroups) as process:
        await asyncio.sleep(SETTLED_S)
        begun_s = time.monotonic()
        assert process.stdin is not None
        process.stdin.write(b"\n")
        process.stdin.flush()
        await asyncio.sleep(long_s)
    return Span(begun_s, time.monotonic())

"""What the benchmarks share: repeats and their spread, calls that are timed, the machine in words,
Markdown tables."""

from __future__ import annotations

import asyncio
import os
import platform
import statistics
import time
from collections.abc import Awaitable, Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

CLOCK_TICKS = os.sysconf("SC_CLK_TCK")

REQUEST = {"data": "q" * 185}
"""200 bytes with its envelope."""
REPLY = {"data": "a" * 85}
"""100 bytes."""
IN_FLIGHT = 64
WARMING = 200
"""Calls before anything is measured."""


@dataclass(frozen=True, slots=True)
class Spread:
    """Repeats of one measurement."""

    repeats: tuple[float, ...]

    @property
    def median(self) -> float:
        """The figure to compare."""
        return statistics.median(self.repeats)

    def __format__(self, spec: str) -> str:
        low, high = min(self.repeats), max(self.repeats)
        return f"{self.median:{spec}} ({low:{spec}}-{high:{spec}})"


def ratio(ours: Spread, theirs: Spread) -> str:
    """Ours as a part of theirs, repeat by repeat (each pair ran side by side).

    >>> ratio(Spread((1.0, 3.0)), Spread((2.0, 3.0))), ratio(Spread((1.0,)), Spread((0.0,)))
    ('0.75 (0.50-1.00)', '-')
    """
    pairs = zip(ours.repeats, theirs.repeats, strict=True)
    parts = tuple(a / b for a, b in pairs if b)
    return format(Spread(parts), ".2f") if parts else "-"


def percentile(values: Sequence[float], percent: float) -> float:
    """The nearest-rank percentile."""
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(len(ordered) * percent / 100))]


class Calling(Protocol):
    """A way to call the other process."""

    async def in_turn(self, calls: int) -> list[float]:
        """Call so often, one after the other: the seconds that each call took."""

    async def at_once(self, calls: int) -> None:
        """Call so often, with `IN_FLIGHT` calls under way."""


class LoopCalling:
    """Calls that are awaited on the loop."""

    def __init__(self, call: Callable[[], Awaitable[Any]]) -> None:
        self._call = call

    async def in_turn(self, calls: int) -> list[float]:
        """One after the other."""
        took_s = []
        for _ in range(calls):
            begun_s = time.perf_counter()
            await self._call()
            took_s.append(time.perf_counter() - begun_s)
        return took_s

    async def at_once(self, calls: int) -> None:
        """As tasks."""
        left = iter(range(calls))

        async def caller() -> None:
            for _ in left:
                await self._call()

        await asyncio.gather(*(caller() for _ in range(IN_FLIGHT)))


class ThreadCalling:
    """Calls that block their thread; there is nothing else on the loop."""

    def __init__(self, call: Callable[[], Any]) -> None:
        self._call = call

    async def in_turn(self, calls: int) -> list[float]:
        """One after the other, in this thread."""
        took_s = []
        for _ in range(calls):
            begun_s = time.perf_counter()
            self._call()
            took_s.append(time.perf_counter() - begun_s)
        return took_s

    async def at_once(self, calls: int) -> None:
        """Make the calls from `IN_FLIGHT` threads at a time."""
        with ThreadPoolExecutor(IN_FLIGHT) as threads:
            for done in [threads.submit(self._call) for _ in range(calls)]:
                done.result()


@dataclass(frozen=True, slots=True)
class CallFigures:
    """One repeat."""

    median_us: float
    p99_us: float
    cpu_us: float
    """Both processes together, per call."""
    burst_calls: float
    """Calls per second with `IN_FLIGHT` under way."""
    burst_cpu_us: float


async def measure_calls(calling: Calling, pid: int, calls: int) -> CallFigures:
    """Call a process: `calls` times in turn, and four times as often at once."""
    await calling.in_turn(WARMING)
    before_s = cpu_s() + cpu_s(pid)
    took_s = await calling.in_turn(calls)
    between_s = cpu_s() + cpu_s(pid)
    begun_s = time.perf_counter()
    await calling.at_once(4 * calls)
    burst_s = time.perf_counter() - begun_s
    after_s = cpu_s() + cpu_s(pid)
    return CallFigures(
        median_us=percentile(took_s, 50) * 1e6,
        p99_us=percentile(took_s, 99) * 1e6,
        cpu_us=(between_s - before_s) / calls * 1e6,
        burst_calls=4 * calls / burst_s,
        burst_cpu_us=(after_s - between_s) / (4 * calls) * 1e6,
    )


_CALL_COLUMNS = {
    "one in flight: median µs": ("median_us", ".0f"),
    "p99 µs": ("p99_us", ".0f"),
    "CPU µs per call": ("cpu_us", ".0f"),
    f"{IN_FLIGHT} in flight: calls/s": ("burst_calls", ",.0f"),
    "CPU µs per call ": ("burst_cpu_us", ".0f"),
}


def call_table(
    found: Mapping[str, Sequence[CallFigures]], ratios: Mapping[str, tuple[str, str]]
) -> str:
    """A row for each way to call, and one for each ratio: its name → the two ways."""
    fields = dict(_CALL_COLUMNS.values())
    spreads = {
        way: {field: Spread(tuple(getattr(one, field) for one in figures)) for field in fields}
        for way, figures in found.items()
    }
    rows = [
        [way, *(format(spread[field], style) for field, style in fields.items())]
        for way, spread in spreads.items()
    ]
    rows += [
        [name, *(ratio(spreads[ours][field], spreads[theirs][field]) for field in fields)]
        for name, (ours, theirs) in ratios.items()
    ]
    return table(["", *_CALL_COLUMNS], rows)


def cpu_s(pid: int | str = "self") -> float:
    """CPU seconds that a process has used so far, in user and kernel mode."""
    stat = Path(f"/proc/{pid}/stat").read_text(encoding="ascii")
    fields = stat.rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / CLOCK_TICKS


def machine() -> str:
    """The machine in one line, by what matters to the figures."""
    processors = f"{len(os.sched_getaffinity(0))} × {platform.machine()}"
    release = platform.release().partition("-")[0]
    priority = f", niceness {os.nice(0)}" if os.nice(0) else ""
    if os.sched_getscheduler(0) == os.SCHED_IDLE:
        priority += ", only while nothing else ran (SCHED_IDLE)"
    return f"{processors}, Linux {release}, CPython {platform.python_version()}{priority}"


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def write(name: str, text: str) -> None:
    """Write a page of docs/benchmarks, and show it."""
    page = Path(__file__).parent.parent / "docs" / "benchmarks" / f"{name}.md"
    page.parent.mkdir(parents=True, exist_ok=True)
    page.write_text(text, encoding="utf-8")
    print(text)

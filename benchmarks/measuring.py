"""What the benchmarks share: repeats and their spread, the machine in words, Markdown tables."""

from __future__ import annotations

import os
import platform
import statistics
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

CLOCK_TICKS = os.sysconf("SC_CLK_TCK")


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
    """Ours as a part of theirs, repeat by repeat (each pair ran side by side)."""
    pairs = zip(ours.repeats, theirs.repeats, strict=True)
    return format(Spread(tuple(a / b for a, b in pairs if b)), ".2f")


def percentile(values: Sequence[float], percent: float) -> float:
    """The nearest-rank percentile."""
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(len(ordered) * percent / 100))]


def cpu_s(pid: int | str = "self") -> float:
    """CPU seconds that a process has used so far, in user and kernel mode."""
    stat = Path(f"/proc/{pid}/stat").read_text(encoding="ascii")
    fields = stat.rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / CLOCK_TICKS


def machine() -> str:
    """The machine in one line, by what matters to the figures."""
    model = next(
        (
            line.partition(":")[2].strip()
            for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
            if line.startswith(("model name", "Model"))
        ),
        platform.machine(),
    )
    cores = len(os.sched_getaffinity(0))
    release = platform.release().partition("-")[0]
    priority = f", niceness {os.nice(0)}" if os.nice(0) else ""
    return f"{cores} × {model}, Linux {release}, CPython {platform.python_version()}{priority}"


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

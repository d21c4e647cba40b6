"""What processes take: memory by share (proc(5), smaps_rollup) and processor time (stat)."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Iterator
from pathlib import Path

PROC = Path("/proc")
_QUIET_S = 0.6
"""How long nothing may have been done for processes to count as at rest."""
_CALM = 0.95
"""Idle share of the processors from which on a machine counts as calm."""
_CALM_S = 0.5
_TICK_S = 1 / os.sysconf("SC_CLK_TCK")


def pss_mb(pid: int, proc: Path = PROC) -> float:
    """Proportional set size of one process in MB (10^6 bytes)."""
    for line in (proc / str(pid) / "smaps_rollup").read_text().splitlines():
        if line.startswith("Pss:"):
            return int(line.split()[1]) * 1024 / 1e6
    raise ValueError(f"process {pid} has no Pss")


def descendants(pid: int, proc: Path = PROC) -> Iterator[int]:
    """All processes below one, nearest first; those that end meanwhile may be left out."""
    children: list[int] = []
    with contextlib.suppress(OSError):
        for task in sorted((proc / str(pid) / "task").iterdir()):
            children += map(int, (task / "children").read_text().split())
    for child in children:
        yield child
        yield from descendants(child, proc)


def cpu_s(pid: int, proc: Path = PROC) -> float:
    """Processor time of a process and of all below it, those that have ended included."""
    total = 0
    for one in (pid, *descendants(pid, proc)):
        try:
            stat = (proc / str(one) / "stat").read_text()
        except OSError:  # it has just ended, and counts with its parent now
            continue
        fields = stat.rpartition(")")[2].split()
        total += sum(map(int, fields[11:15]))  # utime, stime, cutime, cstime
    return total * _TICK_S


def await_rest(pid: int, *, timeout_s: float) -> None:
    """Wait until a process and all below it have done next to nothing for a while.

    Raises `TimeoutError`.
    """
    until_s = time.monotonic() + timeout_s
    before = cpu_s(pid)
    while time.monotonic() < until_s:
        time.sleep(_QUIET_S)
        after = cpu_s(pid)
        if after - before <= 2 * _TICK_S:
            return
        before = after
    raise TimeoutError(f"process {pid} does not come to rest")


def await_calm(*, timeout_s: float) -> bool:
    """Wait until the whole machine has next to nothing to do; answer whether that came."""
    until_s = time.monotonic() + timeout_s
    before = processor_ticks()
    while time.monotonic() < until_s:
        time.sleep(_CALM_S)
        after = processor_ticks()
        if is_calm(before, after):
            return True
        before = after
    return False


def is_calm(before: tuple[int, int], after: tuple[int, int]) -> bool:
    """Whether processors were idle between two looks at their ticks.

    >>> is_calm((100, 200), (196, 300)), is_calm((100, 200), (190, 300))
    (True, False)
    """
    return after[0] - before[0] >= _CALM * (after[1] - before[1])


def processor_ticks(proc: Path = PROC) -> tuple[int, int]:
    """Idle time and all time of all processors since the machine started."""
    first, _, _ = (proc / "stat").read_text().partition("\n")
    ticks = [int(word) for word in first.split()[1:9]]
    return ticks[3] + ticks[4], sum(ticks)  # idle and iowait

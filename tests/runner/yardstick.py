"""How fast this machine is and how much of it others use: whether times can be judged at all."""

from __future__ import annotations

import hashlib
import os
import resource
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

SLOWER_BY = 1.25
"""A machine that takes this much longer than the one of the budgets is not judged."""
OTHERS = 0.10
"""Nor is one of whose processor time other programs take this share."""

_ROUNDS = 600
_BLOCK = bytes(1_000_000)


@dataclass(frozen=True, slots=True)
class Usage:
    """Processor seconds since the machine was booted."""

    at_s: float
    busy_s: float
    """Of all processes, and of other machines on the same hardware (steal)."""
    own_s: float
    """Of this process and of its descendants that have ended."""

    @classmethod
    def now(cls) -> Usage:
        """Read from /proc/stat (proc(5)) and getrusage(2)."""
        words = Path("/proc/stat").read_text(encoding="ascii").split("\n", 1)[0].split()[1:]
        ticks = [int(word) for word in words]
        idle = ticks[3] + ticks[4]
        busy_s = (sum(ticks[:8]) - idle) / os.sysconf("SC_CLK_TCK")
        used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
        own_s = sum(one.ru_utime + one.ru_stime for one in used)
        return cls(time.monotonic(), busy_s, own_s)


def foreign_load(before: Usage, after: Usage, processors: int) -> float:
    """The share of all processor time that other programs took, 0 to 1."""
    possible_s = (after.at_s - before.at_s) * processors
    others_s = (after.busy_s - before.busy_s) - (after.own_s - before.own_s)
    return min(1.0, max(0.0, others_s / possible_s)) if possible_s > 0 else 0.0


def measured_s(processors: int) -> float:
    """Seconds for a fixed piece of work on all processors at once."""
    begun_s = time.monotonic()
    with ProcessPoolExecutor(processors) as pool:
        list(pool.map(_work, range(processors)))
    return time.monotonic() - begun_s


def _work(number: int) -> int:
    for _ in range(_ROUNDS):
        hashlib.sha256(_BLOCK).digest()
        number += sum(i * i for i in range(20_000))
    return number

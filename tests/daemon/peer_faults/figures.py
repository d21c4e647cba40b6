"""What an attack costs a host, and those who call it."""

from __future__ import annotations

import os
import statistics
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from tests.daemon.peer_faults.crew import note
from tests.daemon.peer_faults.remote import Member


@dataclass
class Figures:
    """All of it, once the attack is over."""

    calls: int = 0
    middle_ms: float = 0.0
    p99_ms: float = 0.0
    growth_kb: int = 0
    peak_kb: int = 0
    """By how much it had more at any moment than before."""
    cpu: float = 0.0
    """Share of one core that the host took."""


@contextmanager
def measured(caller: Member, victim: Member) -> Iterator[Figures]:
    """Have a host call another one meanwhile: a call that is not answered fails the test."""
    figures = Figures()
    before_kb, began_s, spent_s = victim.weight_kb(), time.monotonic(), _spent_s(victim.pid)
    victim.forget_peak()
    usual_kb = victim.peak_kb()
    caller.ask("time", peer=victim.name, every_s=0.01)
    yield figures
    figures.cpu = (_spent_s(victim.pid) - spent_s) / (time.monotonic() - began_s)
    times = caller.ask("times")["times"]
    percentiles = statistics.quantiles(times, n=100)
    figures.calls, figures.middle_ms = len(times), percentiles[49] * 1000
    figures.p99_ms = percentiles[98] * 1000
    figures.growth_kb = victim.weight_kb() - before_kb
    figures.peak_kb = victim.peak_kb() - usual_kb
    note(
        f"{figures.calls} calls: median {figures.middle_ms:.1f} ms, p99 {figures.p99_ms:.1f} ms; "
        f"{figures.cpu:.0%} of a core; {figures.growth_kb:+} kB, {figures.peak_kb:+} kB at most, "
        f"{victim.descriptors()} descriptors"
    )
    note(str(victim.ask("status")))


def _spent_s(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

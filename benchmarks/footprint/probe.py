"""What a host takes of its machine, seen from outside: `python3 probe.py PID SECONDS` prints JSON.

A separate program that uses only the standard library, so that it runs on any machine.
It must be root, or the user that the host runs as.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

PROC = Path("/proc")
KINDS = {
    "nondum.host.mind.planner_child": "planner",
    "nondum.host.jobs.child": "drive child",
    "nondum.host.peers.links": "links",
    "bootstrap.py": "worker",
}
"""Parts of command lines, and the kind of process that has each; `_kind` knows bubblewrap, too."""
YARDSTICK = "import asyncio, email.message, http.client, json, logging, sqlite3, ssl, zipfile"
"""What a start is measured against, in the same machine: an interpreter that imports this much of
the standard library."""
YARDSTICKS = 5


def look(daemon: int, seconds: float) -> dict[str, Any]:
    """Watch a host that is left alone; everything is over the whole time, memory is at its end."""
    family = [daemon, *_descendants(daemon)]
    ticks, switches = _each(_ticks, family), _each(_switches, family)
    written, synced = _each(_written, family), _disk()
    began = time.monotonic()
    time.sleep(seconds)
    passed = time.monotonic() - began
    per_hour = 3600 / passed
    hertz = os.sysconf("SC_CLK_TCK")
    now = _each(_ticks, family)
    woken = _each(_switches, family)[daemon] - switches[daemon]
    return {
        "seconds": passed,
        "cpu_percent": (now[daemon] - ticks[daemon]) / hertz / passed * 100,
        "cpu_percent_all": (sum(now.values()) - sum(ticks.values())) / hertz / passed * 100,
        "wakeups_per_s": woken / passed,
        "kb_written_per_hour": (_sum_of(_written, family, written)) / 1024 * per_hour,
        "disk_writes_per_hour": (_disk()[0] - synced[0]) * per_hour,
        "disk_kb_per_hour": (_disk()[1] - synced[1]) / 2 * per_hour,
        "memory_kb": memory(daemon),
    }


def memory(daemon: int) -> dict[str, list[int]]:
    """Proportional set size of each process, by kind, the greatest first."""
    found: dict[str, list[int]] = {"daemon": [pss_kb(daemon)]}
    for pid in _descendants(daemon):
        found.setdefault(_kind(pid), []).append(pss_kb(pid))
    return {kind: sorted(sizes, reverse=True) for kind, sizes in found.items()}


def yardstick() -> float:
    """Seconds of a processor that the yardstick takes here and now: the least of some."""
    return min(_taken() for _ in range(YARDSTICKS))


def processor_s(pid: int) -> float:
    """Seconds of a processor that a process has taken so far, without its children."""
    return _ticks(pid) / os.sysconf("SC_CLK_TCK")


def _taken() -> float:
    before = os.times()
    subprocess.run(["/usr/bin/python3", "-I", "-c", YARDSTICK], check=True)
    now = os.times()
    user_s = now.children_user - before.children_user
    return user_s + now.children_system - before.children_system


def _descendants(pid: int) -> Iterator[int]:
    try:
        children = (PROC / f"{pid}/task/{pid}/children").read_text(encoding="ascii").split()
        threads = (PROC / f"{pid}/task").iterdir()
        more = [t / "children" for t in threads if t.name != str(pid)]
        children += [word for path in more for word in path.read_text(encoding="ascii").split()]
    except OSError:
        return
    for child in map(int, children):
        yield child
        yield from _descendants(child)


def _kind(pid: int) -> str:
    try:
        words = (PROC / f"{pid}/cmdline").read_bytes().decode(errors="replace").split("\0")
    except OSError:
        return "other"
    program = Path(words[0]).name
    if program == "bwrap":
        return "init"
    said = " ".join(words)
    return next((kind for part, kind in KINDS.items() if part in said), "other")


def pss_kb(pid: int) -> int:
    """Proportional set size of a process; 0: it is gone."""
    try:
        text = (PROC / f"{pid}/smaps_rollup").read_text(encoding="ascii")
    except OSError:
        return 0
    (line,) = (line for line in text.splitlines() if line.startswith("Pss:"))
    return int(line.split()[1])


def _each(look: Any, pids: list[int]) -> dict[int, int]:
    return {pid: look(pid) for pid in pids}


def _sum_of(look: Any, pids: list[int], before: dict[int, int]) -> int:
    return sum(max(0, look(pid) - before[pid]) for pid in pids)


def _ticks(pid: int) -> int:
    try:
        line = (PROC / f"{pid}/stat").read_text(encoding="ascii")
    except OSError:
        return 0
    user, system = line.rpartition(")")[2].split()[11:13]
    return int(user) + int(system)


def _switches(pid: int) -> int:
    """How often its threads began to run again after they had waited."""
    total = 0
    for status in (PROC / f"{pid}/task").glob("*/status"):
        for line in status.read_text(encoding="ascii", errors="replace").splitlines():
            if line.startswith("voluntary_ctxt_switches"):
                total += int(line.split()[1])
    return total


def _written(pid: int) -> int:
    """Bytes that it caused to be written to a disk."""
    try:
        lines = (PROC / f"{pid}/io").read_text(encoding="ascii").splitlines()
    except OSError:
        return 0
    return next(int(line.split()[1]) for line in lines if line.startswith("write_bytes"))


def _disk() -> tuple[int, int]:
    """Writes to the machine's first disk by all processes: their number, and their sectors."""
    for line in (PROC / "diskstats").read_text(encoding="ascii").splitlines():
        words = line.split()
        if words[2] in ("vda", "mmcblk0", "nvme0n1", "sda"):
            return int(words[7]), int(words[9])
    return 0, 0


if __name__ == "__main__":
    found = look(int(sys.argv[1]), float(sys.argv[2]))
    print(json.dumps({**found, "yardstick_s": yardstick()}))

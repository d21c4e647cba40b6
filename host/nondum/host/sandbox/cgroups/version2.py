"""Cgroups of version 2: one hierarchy, of which this daemon has a part (cgroup-v2.rst).

A service that systemd lends its own part (`Delegate=yes`) needs no privilege. Where limits are to
be set for the cgroups inside one, no process may be in that one itself ("no internal processes"),
so the daemon moves to a separate leaf.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

from nondum.host.sandbox.cgroups import files
from nondum.host.sandbox.cgroups.limits import MEGABYTE, CgroupLimits, Usage

WANTED = frozenset({"memory", "pids", "cpu"})
LEAF = "daemon"
PERIOD_US = 100_000


class Version2:
    """The cgroups below a folder of a version 2 hierarchy."""

    kind = "v2"

    def __init__(self, base: Path, controllers: frozenset[str]) -> None:
        self._base = base
        self.controllers = controllers

    @classmethod
    def open(cls, own: Path, top: Path, owner: str) -> Version2 | None:
        """Make a folder for cgroups in this process's own cgroup, or below the top one.

        None where neither can be written.
        """
        best: Version2 | None = None
        for part in (own.parent if own.name == LEAF else own, top):
            tree = cls._below(part, owner)
            if tree is not None and (best is None or tree.controllers > best.controllers):
                best = tree
            if best is not None and best.controllers == WANTED:
                break
        return best

    @classmethod
    def _below(cls, part: Path, owner: str) -> Version2 | None:
        if not WANTED & files.words(part / "cgroup.controllers"):
            return None  # they belong to version 1 here
        if not all(os.access(part / name, os.W_OK) for name in (".", "cgroup.procs")):
            return None
        try:
            _hand_down(part)
            (part / owner).mkdir(exist_ok=True)
        except OSError:
            return None
        return cls(part / owner, _enable(part / owner))

    def make(self, name: str) -> None:
        """Make a cgroup (see `Tree`)."""
        (self._base / name).mkdir(exist_ok=True)

    def limit(self, name: str, limits: CgroupLimits) -> None:
        """Set its limits (see `Tree`)."""
        for file, value in _settings(limits, self.controllers):
            with contextlib.suppress(FileNotFoundError):  # memory.swap.max: a kernel without swap
                files.put(self._base / name / file, value)

    def add(self, name: str, pid: int) -> None:
        """Put one process in."""
        files.put(self._base / name / "cgroup.procs", pid)

    def kill(self, name: str) -> None:
        """SIGKILL all that is in it (Linux 5.14; before that by freezing)."""
        folder = self._base / name
        if (folder / "cgroup.kill").exists():
            with contextlib.suppress(FileNotFoundError):
                files.put(folder / "cgroup.kill", 1)
            return
        files.kill_all(folder, folder / "cgroup.freeze", "1", "0")

    def remove(self, name: str) -> bool:
        """Remove an empty cgroup."""
        return files.remove(self._base / name)

    def pids(self, name: str) -> tuple[int, ...]:
        """The processes in it."""
        return files.pids(self._base / name)

    def usage(self, name: str) -> Usage:
        """What it uses."""
        folder = self._base / name
        memory, tasks = (
            files.numbers(folder / "memory.events"),
            files.numbers(folder / "pids.events"),
        )
        cpu = files.numbers(folder / "cpu.stat")
        return Usage(
            memory_bytes=files.number(folder / "memory.current"),
            tasks=files.number(folder / "pids.current"),
            cpu_s=cpu.get("usage_usec", 0) / 1e6,
            oom_kills=memory.get("oom_kill", 0),
            refused_tasks=tasks.get("max", 0),
            throttled=cpu.get("nr_throttled", 0),
        )

    def names(self) -> tuple[str, ...]:
        """All cgroups."""
        return files.child_names(self._base)

    def close(self) -> None:
        """Remove the folder of the cgroups if they are gone (see `Tree`)."""
        files.remove(self._base)


def _settings(limits: CgroupLimits, controllers: frozenset[str]) -> Iterator[tuple[str, str]]:
    if "memory" in controllers:
        yield "memory.max", str(limits.memory_mb * MEGABYTE)
        yield "memory.swap.max", "0"
        yield "memory.oom.group", "1"  # half a worker is none
    if "pids" in controllers:
        yield "pids.max", str(limits.tasks)
    if "cpu" in controllers:
        quota = str(int(limits.processors * PERIOD_US)) if limits.processors else "max"
        yield "cpu.weight", str(limits.cpu_weight)
        yield "cpu.max", f"{quota} {PERIOD_US}"


def _hand_down(part: Path) -> None:
    """Let the cgroups inside one be limited; this daemon moves out of the way first if it must.

    Of a cgroup with processes, `cpu` and `pids` would be handed down all the same, and then no
    process could enter those inside ("domain invalid"). The root of all has no `cgroup.type`, and
    may have processes.
    """
    wanted = WANTED & files.words(part / "cgroup.controllers")
    if wanted <= files.words(part / "cgroup.subtree_control"):
        return
    is_inside = str(os.getpid()) in files.words(part / "cgroup.procs")
    if is_inside and (part / "cgroup.type").exists():
        (part / LEAF).mkdir(exist_ok=True)
        files.put(part / LEAF / "cgroup.procs", os.getpid())
        if files.words(part / "cgroup.procs"):  # there are others in it, which are not ours to move
            files.put(part / "cgroup.procs", os.getpid())
            files.remove(part / LEAF)
            return
    _enable(part)


def _enable(part: Path) -> frozenset[str]:
    """Enable each controller by itself: one that is missing must not cost the others."""
    there = WANTED & files.words(part / "cgroup.controllers")
    for controller in there - files.words(part / "cgroup.subtree_control"):
        with contextlib.suppress(OSError):
            files.put(part / "cgroup.subtree_control", f"+{controller}")
    return WANTED & files.words(part / "cgroup.subtree_control")

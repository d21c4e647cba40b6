"""Cgroups of version 1: a hierarchy for each controller (cgroup-v1/memory.rst, pids.rst,
freezer-subsystem.rst). Needs root, or the helper.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from nondum.host.sandbox.cgroups import files
from nondum.host.sandbox.cgroups.hierarchies import Mounted
from nondum.host.sandbox.cgroups.limits import MEGABYTE, WEIGHT, CgroupLimits, Usage

USED = ("memory", "pids", "cpu", "cpuacct", "freezer")
LIMITING = frozenset({"memory", "pids", "cpu"})
PERIOD_US = 100_000
SHARES = 1024
"""cpu.shares of a process that has no own weight."""


class Version1:
    """The cgroups below a folder in each of several hierarchies."""

    kind = "v1"

    def __init__(self, bases: Mapping[str, Path]) -> None:
        self._bases = bases
        """Controller → folder of the cgroups."""
        self.controllers = LIMITING & bases.keys()

    @classmethod
    def open(cls, hierarchies: Iterable[Mounted], owner: str) -> Version1 | None:
        """Make a folder for cgroups wherever a controller is mounted; None where none is."""
        bases: dict[str, Path] = {}
        for hierarchy in hierarchies:
            for controller in hierarchy.controllers & set(USED):
                if (base := _made(hierarchy, owner)) is not None:
                    bases[controller] = base
        return cls(bases) if LIMITING & bases.keys() else None

    def make(self, name: str) -> None:
        """Make a cgroup (see `Tree`)."""
        for folder in self._folders(name):
            folder.mkdir(exist_ok=True)

    def limit(self, name: str, limits: CgroupLimits) -> None:
        """Set its limits (see `Tree`)."""
        for controller, file, value in _settings(limits):
            if controller in self._bases:
                with contextlib.suppress(FileNotFoundError):  # memsw: a kernel without swap
                    files.put(self._bases[controller] / name / file, value)

    def add(self, name: str, pid: int) -> None:
        """Put one process in."""
        for folder in self._folders(name):
            files.put(folder / "cgroup.procs", pid)

    def kill(self, name: str) -> None:
        """SIGKILL all that is in it."""
        for folder in self._folders(name):
            freezer = self._bases.get("freezer", self._bases.get("pids", folder.parent)) / name
            files.kill_all(folder, freezer / "freezer.state", "FROZEN", "THAWED")

    def remove(self, name: str) -> bool:
        """Remove an empty cgroup."""
        return all([files.remove(folder) for folder in self._folders(name)])

    def pids(self, name: str) -> tuple[int, ...]:
        """The processes in it."""
        return files.pids(self._folders(name)[0])

    def usage(self, name: str) -> Usage:
        """What it uses."""
        return Usage(
            memory_bytes=files.number(self._file("memory", name, "memory.usage_in_bytes")),
            tasks=files.number(self._file("pids", name, "pids.current")),
            cpu_s=files.number(self._file("cpuacct", name, "cpuacct.usage")) / 1e9,
            oom_kills=self._count("memory", name, "memory.oom_control", "oom_kill"),
            refused_tasks=self._count("pids", name, "pids.events", "max"),
            throttled=self._count("cpu", name, "cpu.stat", "nr_throttled"),
        )

    def names(self) -> tuple[str, ...]:
        """All cgroups."""
        found = {name for base in self._bases.values() for name in files.child_names(base)}
        return tuple(sorted(found))

    def close(self) -> None:
        """Remove the folders of the cgroups if they are gone (see `Tree`)."""
        for base in self._bases.values():
            files.remove(base)

    def _folders(self, name: str) -> list[Path]:
        return sorted({base / name for base in self._bases.values()})

    def _file(self, controller: str, name: str, file: str) -> Path:
        return self._bases.get(controller, Path("/nonexistent")) / name / file

    def _count(self, controller: str, name: str, file: str, key: str) -> int:
        return files.numbers(self._file(controller, name, file)).get(key, 0)


def _made(hierarchy: Mounted, owner: str) -> Path | None:
    """The folder for cgroups in this process's own cgroup, or below the topmost."""
    for part in (hierarchy.own, hierarchy.top):
        if os.access(part, os.W_OK):
            with contextlib.suppress(OSError):
                (part / owner).mkdir(exist_ok=True)
                return part / owner
    return None


def _settings(limits: CgroupLimits) -> Iterator[tuple[str, str, int]]:
    size = limits.memory_mb * MEGABYTE
    # The sum of memory and swap may never be below the memory, whatever both were before.
    yield "memory", "memory.memsw.limit_in_bytes", -1
    yield "memory", "memory.limit_in_bytes", size
    yield "memory", "memory.memsw.limit_in_bytes", size
    yield "pids", "pids.max", limits.tasks
    quota = int(limits.processors * PERIOD_US) if limits.processors else -1
    yield "cpu", "cpu.shares", max(2, limits.cpu_weight * SHARES // WEIGHT)
    yield "cpu", "cpu.cfs_period_us", PERIOD_US
    yield "cpu", "cpu.cfs_quota_us", quota

"""What a worker uses now, as its cgroup and proc(5) tell."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Iterator
from pathlib import Path

from nondum.host.sandbox.cgroups import Cgroup, Usage
from nondum.host.sandbox.inside import open_files
from nondum.host.workers import held_memory, scratch
from nondum.host.workers.init_link import OpenFiles
from nondum.host.workers.limits import Reading

TICKS_HZ = os.sysconf("SC_CLK_TCK")


class UsageReader:
    """One worker's: of all its processes, where a cgroup holds them."""

    def __init__(self, first: Callable[[], int], cgroup: Cgroup | None) -> None:
        """`first` tells its first process, as far as that is known by then."""
        self._first, self._cgroup = first, cgroup

    def pids(self) -> tuple[int, ...]:
        """Its processes, as far as they are known."""
        held = self._cgroup.pids() if self._cgroup is not None else ()
        return held or (self._first(),)

    @property
    def is_whole(self) -> bool:
        """Whether these are all of them."""
        return self._cgroup is not None and bool(self._cgroup.pids())

    def usage(self) -> Usage:
        """What it uses; without a cgroup, the processor time of its first process only."""
        if self._cgroup is not None and self._cgroup.pids():
            return self._cgroup.usage()
        return Usage(cpu_s=_cpu_s(self._first()))

    def held_bytes(self) -> int:
        """Memory that its processes hold: its descendants too, without a cgroup."""
        is_whole = self.is_whole
        return held_memory.held_bytes(
            self.pids() if is_whole else held_memory.family(self._first())
        )

    def wanted_s(self) -> dict[int, float]:
        """Thread → seconds that it has run or waited for a processor (sched-stats.rst)."""
        return {task: wanted_s for pid in self.pids() for task, wanted_s in _wanted_s(pid)}

    def descriptors(self) -> int:
        """Open files of that process of its which has most, as far as they may be counted."""
        return open_files.most(self.pids())

    def reading(
        self, told: OpenFiles | None, folder: Path, now_s: Callable[[], float], *, is_asked: bool
    ) -> Reading:
        """All of it, for a worker whose scratch folder is `folder`. Blocks.

        `told` is what its init says of open files, where this process cannot look at them.
        """
        if told is None:
            descriptors = self.descriptors()
            used = scratch.used_bytes(folder, self.pids())
        else:
            descriptors = told.descriptors
            used = scratch.used_bytes(folder) + told.deleted_bytes
        usage = self.usage()
        return Reading(
            at_s=now_s(),
            usage=usage,
            held_bytes=0 if usage.memory_bytes else self.held_bytes(),
            descriptors=descriptors,
            wanted_s=self.wanted_s(),
            scratch_bytes=used,
            is_asked=is_asked,
        )


def _wanted_s(pid: int) -> Iterator[tuple[int, float]]:
    with contextlib.suppress(OSError):  # it has ended
        for task in Path(f"/proc/{pid}/task").iterdir():
            with contextlib.suppress(OSError, ValueError):
                run_ns, wait_ns, _ = (task / "schedstat").read_text(encoding="ascii").split()
                yield int(task.name), (int(run_ns) + int(wait_ns)) / 1e9


def _cpu_s(pid: int) -> float:
    try:
        line = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return 0.0
    fields = line.rpartition(")")[2].split()  # the name may hold anything
    return (int(fields[11]) + int(fields[12])) / TICKS_HZ

"""What a worker's cgroup allows, and what has been used of it.

Sources: kernel.org, Documentation/admin-guide/cgroup-v2.rst and cgroup-v1/{memory,pids}.rst.
"""

from __future__ import annotations

import re
from typing import Protocol

from nondum.sdk.frozen import frozen

MEGABYTE = 1024 * 1024
NAME = re.compile(r"[a-z0-9](?:[a-z0-9-]{0,62})\.[0-9]{1,9}")
"""A cgroup's name: a component and a number, since an upgrade has two workers for a while."""
WEIGHT = 100
"""Processor weight of a process that has no own weight (cpu.weight)."""


@frozen
class CgroupLimits:
    """What all processes of one worker may use together."""

    memory_mb: int = 2048
    """Memory, without any swap."""
    tasks: int = 256
    """Processes and threads."""
    cpu_weight: int = WEIGHT
    """Share of the processors when they are wanted by several: 1 to 10,000."""
    processors: float = 0.0
    """Processor seconds in a second; 0: no limit but the weight."""

    def __post_init__(self) -> None:
        """Raise `ValueError` for what no cgroup can be held to: the helper takes a stranger's."""
        if not 1 <= self.memory_mb <= 2**30:
            raise ValueError(f"{self.memory_mb} megabytes are no limit of memory")
        if not 1 <= self.tasks <= 2**22:
            raise ValueError(f"{self.tasks} is no limit of tasks")
        if not 1 <= self.cpu_weight <= 10_000:
            raise ValueError(f"{self.cpu_weight} is no weight: 1 to 10,000")
        if not 0.0 <= self.processors <= 10_000.0:
            raise ValueError(f"{self.processors} is no number of processors")


@frozen
class Usage:
    """What the processes of a cgroup use, and how often they met its limits. 0: not known."""

    memory_bytes: int = 0
    tasks: int = 0
    cpu_s: float = 0.0
    """Processor seconds since the cgroup was made."""
    oom_kills: int = 0
    """Processes that were killed since the memory was used up."""
    refused_tasks: int = 0
    """Processes and threads that could not be started since there were too many."""
    throttled: int = 0
    """Periods of a tenth of a second in which processors were withheld."""


class Tree(Protocol):
    """Where cgroups are: the cgroups of one daemon. Names are of the form of `NAME`."""

    kind: str
    """`v2`, `v1`, or empty where there are none."""
    controllers: frozenset[str]
    """What can be limited: of `memory`, `pids`, `cpu`."""

    def make(self, name: str) -> None:
        """Make a cgroup. Raises `OSError`."""
        ...

    def limit(self, name: str, limits: CgroupLimits) -> None:
        """Set a cgroup's limits. Raises `OSError`."""
        ...

    def add(self, name: str, pid: int) -> None:
        """Put one process in. Raises `OSError`."""
        ...

    def kill(self, name: str) -> None:
        """SIGKILL all that is in it, however much it forks; a cgroup that is gone is fine."""
        ...

    def remove(self, name: str) -> bool:
        """Remove an empty cgroup; answer whether it is gone."""
        ...

    def pids(self, name: str) -> tuple[int, ...]:
        """The processes in it; none once it is gone."""
        ...

    def usage(self, name: str) -> Usage:
        """What it uses; all zeros once it is gone."""
        ...

    def names(self) -> tuple[str, ...]:
        """All cgroups of this daemon, and of its earlier lives."""
        ...

    def close(self) -> None:
        """Remove the place of the cgroups if all of them are gone. Raises nothing."""
        ...

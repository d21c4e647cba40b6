"""The cgroups of a daemon's workers: limits on all processes of one together, and their sure end.

Version 2 is used where there is any, version 1 where that has the controllers; where there is
neither, or the daemon may not use them, cgroups hold no processes and say so.
"""

from __future__ import annotations

import contextlib
import hashlib
import itertools
import os
import time
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path

from nondum.host.sandbox.cgroups import hierarchies
from nondum.host.sandbox.cgroups.hierarchies import Mounted
from nondum.host.sandbox.cgroups.limits import CgroupLimits, Tree, Usage
from nondum.host.sandbox.cgroups.version1 import Version1
from nondum.host.sandbox.cgroups.version2 import Version2
from nondum.sdk.errors import Problem

EMPTY_S = 1.0
"""How long killed processes are waited for: one in uninterruptible sleep may never end."""
PAUSE_S = 0.005
GENERATIONS = 2
"""How often the children of a process that is put in are looked for: they may fork meanwhile."""


class Cgroup:
    """One worker's. Its methods block for microseconds, but for `end`."""

    def __init__(self, tree: Tree, name: str) -> None:
        self._tree = tree
        self.name = name

    def limit(self, limits: CgroupLimits) -> None:
        """Change its limits: a spare interpreter is put in before it is known whose it will be.

        Raises `OSError`.
        """
        self._tree.limit(self.name, limits)

    def add(self, pid: int) -> None:
        """Put a process in, with all that it has started. Raises `OSError`.

        The kernel may take some 20 ms for it, five times less where no other was put in just now.
        """
        self._tree.add(self.name, pid)
        for _ in range(GENERATIONS):  # what these start from now on is in it by itself
            for child in tuple(_descendants(pid)):
                with contextlib.suppress(ProcessLookupError):
                    self._tree.add(self.name, child)

    def pids(self) -> tuple[int, ...]:
        """The processes in it."""
        return self._tree.pids(self.name)

    def usage(self) -> Usage:
        """What it uses; all zeros once it is removed."""
        return self._tree.usage(self.name)

    def kill(self) -> None:
        """SIGKILL all that is in it, however much it forks."""
        self._tree.kill(self.name)

    def remove(self) -> bool:
        """Remove it once it is empty; answer whether it is gone."""
        return self._tree.remove(self.name)

    def end(self) -> bool:
        """Kill all that is in it and remove it; answer whether it is gone. Blocks up to a second:
        not for the loop. Raises `OSError`.
        """
        until_s = time.monotonic() + EMPTY_S
        while True:
            failure = self._kill()
            if self.remove():
                return True
            if time.monotonic() >= until_s:
                if failure is not None:
                    raise failure
                return False
            time.sleep(PAUSE_S)

    def _kill(self) -> OSError | None:
        """`kill`; why that cannot be done now: it may be empty all the same."""
        try:
            self.kill()
        except OSError as error:  # no descriptor is left, say
            return error
        return None


class Cgroups:
    """Makes cgroups. `sweep` away those of an earlier life first."""

    def __init__(self, tree: Tree) -> None:
        self._tree = tree
        taken = [int(name.rpartition(".")[2]) for name in tree.names() if "." in name]
        self._numbers = itertools.count(max(taken, default=0) + 1)

    @classmethod
    def open(cls, state: Path) -> Cgroups:
        """Look for what this machine has. One daemon's cgroups are apart from others', by the
        `state` folder that it has claimed.
        """
        return cls(tree(hierarchies.here(), owner(state)))

    @property
    def kind(self) -> str:
        """`v2`, `v1`, or empty: none."""
        return self._tree.kind

    @property
    def holds(self) -> frozenset[str]:
        """What is really limited: of `memory`, `pids`, `cpu`."""
        return self._tree.controllers

    def make(self, component: str, limits: CgroupLimits) -> Cgroup:
        """Make a cgroup for a new worker of a component. Raises `OSError`; then there is none."""
        cgroup = Cgroup(self._tree, f"{component}.{next(self._numbers)}")
        try:
            self._tree.make(cgroup.name)  # of version 1 it may be made in part
            cgroup.limit(limits)
        except OSError:
            with contextlib.suppress(OSError):  # the first failure is the one to report
                cgroup.remove()
            raise
        return cgroup

    def sweep(self, keep: Collection[str] = ()) -> int:
        """End all cgroups but those named: what a dead daemon left. Returns how many there were.

        Blocks up to a second for each: not for the loop.
        """
        left = [name for name in self._tree.names() if name not in keep]
        for name in left:
            Cgroup(self._tree, name).end()
        return len(left)

    def close(self) -> None:
        """Let go of the place where cgroups are; call it once all have ended."""
        self._tree.close()

    def problems(self) -> tuple[Problem, ...]:
        """What cannot be limited here, and what to do about it."""
        machine = known(Path("/proc/cgroups").read_text(encoding="ascii"))
        return tuple(problems_of(self._tree, machine))


class NoTree:
    """Where there are no cgroups that this daemon may use: cgroups that hold no processes."""

    kind = ""
    controllers: frozenset[str] = frozenset()

    def make(self, name: str) -> None:
        """Do nothing."""

    def limit(self, name: str, limits: CgroupLimits) -> None:
        """Do nothing."""

    def add(self, name: str, pid: int) -> None:
        """Do nothing."""

    def kill(self, name: str) -> None:
        """Do nothing."""

    def remove(self, name: str) -> bool:
        """Nothing is left of it."""
        return True

    def pids(self, name: str) -> tuple[int, ...]:
        """None are known."""
        return ()

    def usage(self, name: str) -> Usage:
        """Nothing is known."""
        return Usage()

    def names(self) -> tuple[str, ...]:
        """None."""
        return ()

    def close(self) -> None:
        """Do nothing."""


def owner(state: Path) -> str:
    """The name of a daemon's part of a hierarchy.

    >>> owner(Path("/var/lib/nondum"))
    'nondum-a90456a7'
    """
    return f"nondum-{hashlib.sha256(os.fsencode(state.absolute())).hexdigest()[:8]}"


def tree(hierarchies: Sequence[Mounted], owner: str) -> Tree:
    """The best that can be had: version 2 if it limits anything, else version 1, else none."""
    found: Tree | None = None
    for hierarchy in hierarchies:
        if not hierarchy.controllers:
            found = Version2.open(hierarchy.own, hierarchy.top, owner)
    if found is None or not found.controllers:
        found = Version1.open(hierarchies, owner) or found
    return found or NoTree()


def _descendants(pid: int) -> Iterator[int]:
    with contextlib.suppress(OSError):  # it has just ended
        for task in Path(f"/proc/{pid}/task").iterdir():
            for child in (task / "children").read_text(encoding="ascii").split():
                yield int(child)
                yield from _descendants(int(child))


def problems_of(tree: Tree, machine: Collection[str]) -> Iterator[Problem]:
    """What a tree does not limit, apart for controllers that the machine has and has not."""
    missing = [name for name in _MISSING if name not in tree.controllers]
    if withheld := [name for name in missing if name in machine]:
        yield Problem(
            "CGROUPS_WITHHELD",
            f"workers' {', '.join(_WHAT[name] for name in withheld)} are not limited together: "
            "this daemon may not use the machine's cgroups",
            need=", ".join(withheld),
            have=tree.kind or "none",
            fix="run nondum as the service that its package installs, or as root; by hand: "
            "`systemd-run --user --scope -p Delegate=yes nondum host run --user`",
        )
    for name in missing:
        if name not in machine:
            message, fix = _MISSING[name]
            code = f"CGROUP_{name.upper()}_MISSING"
            yield Problem(code, f"this machine has no {name} cgroup: {message}", fix=fix)


def known(cgroups: str) -> frozenset[str]:
    """The controllers that a kernel has and uses, by `/proc/cgroups`.

    >>> sorted(known("#subsys_name hierarchy num_cgroups enabled\\nmemory 0 1 0\\npids 0 1 1"))
    ['pids']
    """
    rows = (line.split() for line in cgroups.splitlines() if not line.startswith("#"))
    return frozenset(row[0] for row in rows if len(row) == 4 and row[3] == "1")


_WHAT = {"memory": "memory", "pids": "processes and threads", "cpu": "processor time"}
_MISSING = {
    "memory": (
        "a worker's memory is bounded process by process only",
        "add `cgroup_enable=memory cgroup_memory=1` to the one line of "
        "/boot/firmware/cmdline.txt (Raspberry Pi OS), or boot without cgroup_disable=memory",
    ),
    "pids": (
        "a worker may start any number of processes",
        "use a kernel with CONFIG_CGROUP_PIDS",
    ),
    "cpu": (
        "a worker may take processor time from others",
        "use a kernel with CONFIG_FAIR_GROUP_SCHED",
    ),
}

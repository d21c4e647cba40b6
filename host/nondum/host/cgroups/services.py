"""The cgroups of services of systemd, which are systemd's: looked at, never changed.

Source: systemd.slice(5): a service's cgroup is named for its unit, in the folder of its slice.
"""

from __future__ import annotations

from collections.abc import Sequence

from nondum.host.cgroups import mounts
from nondum.host.cgroups.cage import Tree, Usage
from nondum.host.cgroups.cages import NoTree
from nondum.host.cgroups.legacy import LIMITING, USED, Legacy
from nondum.host.cgroups.mounts import Mounted
from nondum.host.cgroups.unified import WANTED, Unified

SLICE = "system.slice"


class ServiceGroup:
    """What the processes of one service use. Its last reading outlives it."""

    def __init__(self, unit: str, tree: Tree) -> None:
        self._unit, self._tree = unit, tree
        self._last = Usage()

    def pids(self) -> tuple[int, ...]:
        """The processes in it; none before it has started and after it has ended."""
        return self._tree.pids(self._unit)

    def usage(self) -> Usage:
        """What it uses; once it has ended, what it used when that was asked last."""
        if self.pids():
            self._last = self._tree.usage(self._unit)
        return self._last


def service_group(unit: str) -> ServiceGroup:
    """That of a unit in the slice of the system's services. Raises `OSError`."""
    return ServiceGroup(unit, services(mounts.here()))


def services(hierarchies: Sequence[Mounted]) -> Tree:
    """Where the cgroups of services are: of version 2 if that counts anything, else of version 1.

    A tree to read from: nothing in it is its reader's.
    """
    for at in hierarchies:
        folder = at.top / SLICE
        if not at.controllers and (folder / "cgroup.controllers").exists():
            counted = WANTED & set((folder / "cgroup.controllers").read_text("ascii").split())
            if counted:
                return Unified(folder, frozenset(counted))
    bases = {name: at.top / SLICE for at in hierarchies for name in at.controllers & set(USED)}
    return Legacy(bases) if LIMITING & bases.keys() else NoTree()

"""Cgroups that hold no process, and fail as those of a host that has run short of something."""

from __future__ import annotations

import errno
import os
import threading

from nondum.host.sandbox.cgroups.groups import NoTree
from nondum.host.sandbox.cgroups.limits import CgroupLimits


class CountedTree(NoTree):
    """Knows which cgroups there are, and tells when one is limited."""

    def __init__(self) -> None:
        self._names: set[str] = set()
        self.is_limited = threading.Event()

    def make(self, name: str) -> None:
        """Make one."""
        self._names.add(name)

    def limit(self, name: str, limits: CgroupLimits) -> None:
        """Tell that it is asked for."""
        self.is_limited.set()

    def remove(self, name: str) -> bool:
        """Remove one."""
        self._names.discard(name)
        return True

    def names(self) -> tuple[str, ...]:
        """All that are left."""
        return tuple(sorted(self._names))


class StuckTree(NoTree):
    """Can remove none."""

    def remove(self, name: str) -> bool:
        """Fail."""
        raise OSError(errno.EIO, os.strerror(errno.EIO))

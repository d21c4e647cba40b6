"""Level `sandboxed`: a separate sandbox for each worker, made by bubblewrap."""

from __future__ import annotations

import contextlib
import logging
import os
import stat
from collections.abc import Collection, Iterator
from pathlib import Path

from nondum.host.sandbox.helper import privileged
from nondum.host.sandbox.inside import mounts
from nondum.host.sandbox.levels import bubblewrap, refusals
from nondum.host.sandbox.levels.bubblewrap import Ground
from nondum.host.sandbox.levels.users import NewNamespace, Users
from nondum.host.workers.confinement import Entry, calls_refused
from nondum.host.workers.granted_nodes import groups_of, nodes_of
from nondum.host.workers.spec import WorkerSpec, base_interpreter
from nondum.wheelhouse.format.confinement import Level

log = logging.getLogger(__name__)
_LISTED = stat.S_IROTH | stat.S_IXOTH
_CHANGES_GROUND = frozenset({"network", "gpu"})
SHARED_MB = 64
"""Size of /dev/shm."""


class Boxed:
    """Level `sandboxed`: a separate sandbox for each worker, made by bubblewrap."""

    level = Level.SANDBOXED
    has_init = True

    def __init__(
        self,
        bwrap: str,
        places: tuple[Path, ...] = (),
        *,
        has_users: bool = False,
        without: Collection[str] = (),
    ) -> None:
        """`places` are folders in which most workers' code and scratch are: a spare sees them until
        it becomes one. With `has_users`, which takes root or the helper, each worker is a
        separate user.
        """
        self._bwrap, self._places = bwrap, places
        self.has_users, self._users = has_users, Users(privileged().users)
        self.without = frozenset(without)

    def ground(self, spec: WorkerSpec | None) -> Ground:
        """Where the worker's folders are; the usual places will do if they are there."""
        if spec is None:
            return Ground(base_interpreter(), self._places)
        permissions = _CHANGES_GROUND & frozenset(spec.permissions)
        folders = (*spec.readable, spec.scratch)
        usual = Ground(spec.python, self._places, permissions)
        if usual.carries(spec.python, folders, permissions):
            return usual
        return Ground(spec.python, folders, permissions)

    def command(
        self, ground: Ground, orders: int, namespace: NewNamespace | None = None
    ) -> list[str]:
        """Bubblewrap, with the interpreter in it."""
        return bubblewrap.command(self._bwrap, ground, orders, namespace, without=self.without)

    @contextlib.contextmanager
    def entry(self, spec: WorkerSpec, ground: Ground) -> Iterator[Entry]:
        """Its own folders and nodes are brought in, everything outside is shut out."""
        kept = self.without
        groups = refusals.GROUPS
        if "network" in spec.permissions:  # abstract names of sockets belong to the network
            groups = {**groups, "sockets": refusals.SOCKETS_OF_THE_HOST[True]}
        mounts_too = {*kept, "mounts"}
        nodes = tuple(nodes_of(spec))
        user = self._user(spec)
        given = {
            "outside": bubblewrap.OUTSIDE,
            "seen_outside": bubblewrap.seen_outside(ground),
            "hides_outside": "outside" not in kept,
            "code": [str(folder) for folder in spec.readable],
            "protects_code": "code" not in kept,
            "scratch": str(spec.scratch),
            "maps_scratch": user is not None and os.geteuid() != 0,
            "nodes": list(nodes),
            "shared_mb": SHARED_MB,
            "sealed": [] if "settings" in kept else bubblewrap.SEALED,
            "protected": [
                *([] if "system" in kept else bubblewrap.PROTECTED),
                *([] if "nodes" in kept else bubblewrap.NODES),
            ],
            "inotify_instances": mounts.INOTIFY_INSTANCES if "inotify" not in kept else 128,
            "is_last": "user namespaces" not in kept,
            "user": user,
            "groups": sorted(groups_of(nodes)) if os.geteuid() == 0 else None,
            "changes_user": "user" not in kept,
            "init_filter": calls_refused(refusals.GROUPS, mounts_too),
        }
        restrictions = {
            "user": None,
            "keeps_capabilities": "capabilities" in kept,
            "may_gain_privileges": "new privileges" in kept,
            "filter": calls_refused(groups, kept),
        }
        yield Entry(restrictions, mounts=given, user=user)

    def _user(self, spec: WorkerSpec) -> int | None:
        """The worker's own, unless its code is root's alone, by the umask of who installed it."""
        if not self.has_users:
            return None
        closed = [folder for folder in spec.site_packages if not _is_listed(folder)]
        if closed:
            log.warning("%s has the host's user: only that may read %s", spec.component, closed[0])
            return None
        return self._users.of(spec.scratch)


def _is_listed(folder: Path) -> bool:
    """Whether everybody who sees a folder may list it and go in."""
    return folder.stat().st_mode & _LISTED == _LISTED

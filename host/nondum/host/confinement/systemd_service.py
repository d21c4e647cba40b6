"""Level 2: the worker is a transient service of systemd (see `systemd.py`), for machines on which
bubblewrap may not make a room.
"""

from __future__ import annotations

import contextlib
import os
import shutil
from collections.abc import Collection, Iterator
from pathlib import Path

from nondum.host.cgroups.services import service_group
from nondum.host.confinement import refusals, systemd, systemd_stand_in
from nondum.host.confinement.bubblewrap import Ground
from nondum.host.confinement.level import Level
from nondum.host.confinement.systemd import PERMISSIONS
from nondum.host.workers.confinements import Entry, calls_refused
from nondum.host.workers.spec import WorkerSpec, base_interpreter

RUNNING = Path("/run/systemd/system")
"""There where systemd is the first process (sd_booted(3))."""


class Served:
    """Has a stand-in among the daemon's children for each service."""

    level = Level.SERVICE
    has_keeper = False
    without: frozenset[str] = frozenset()

    def __init__(self, *, without: Collection[str] = ()) -> None:
        """`without` leaves groups of system calls out of the filter that the worker puts up."""
        self._without = frozenset(without)

    def ground(self, spec: WorkerSpec | None) -> Ground:
        """All stand-ins are alike: what their services need is in the orders."""
        return Ground(base_interpreter(), (Path("/"),))

    def command(self, ground: Ground, orders: int) -> list[str]:
        """The stand-in."""
        return list(systemd_stand_in.start_command(orders))

    @contextlib.contextmanager
    def entry(self, spec: WorkerSpec, ground: Ground) -> Iterator[Entry]:
        """What the service is to be; capabilities are gone by then."""
        service = {
            "permissions": sorted(PERMISSIONS.intersection(spec.permissions)),
            "has_devices": bool(spec.index.devices),
            "cpu_weight": spec.limits.of_cage().cpu_weight,
        }
        calls = calls_refused(refusals.GROUPS, self._without)
        walls = {
            "user": None,
            "keeps_capabilities": True,
            "may_gain_privileges": False,
            "filter": calls,
            "service": service,
        }
        yield Entry(walls, service=lambda pid: service_group(systemd.unit_of(spec.component, pid)))


def missing() -> str:
    """Why systemd cannot be asked here, in words; empty when it can."""
    if not RUNNING.is_dir():
        return "the first process of this machine is not systemd"
    if shutil.which("systemd-run") is None:
        return "systemd-run is not installed"
    if os.getuid() != 0 and not systemd_stand_in.SOCKET.is_socket():
        return "the daemon is not root, and nondum-warden.socket is not active"
    return ""

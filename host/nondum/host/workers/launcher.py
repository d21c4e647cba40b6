"""The seam of confinement: how a worker's process is started, and what then holds it.

Level 3 will be bubblewrap with cgroup limits, 2 a systemd service, 1 a user of its own with
Landlock. Here is what needs nothing of the system: resource limits, a session of its own, no new
privileges, nothing inherited but the link.
"""

from __future__ import annotations

import logging
import os
import socket
from dataclasses import asdict
from typing import Any, Protocol

from nondum.host.cgroups import Cages
from nondum.host.workers.process import WorkerProcess
from nondum.host.workers.spare import ROOM, ROOM_BYTES, Spare
from nondum.host.workers.spec import WorkerSpec, base_interpreter
from nondum.sdk.errors import Problem, WorkerFailed

MARK = "NONDUM_WORKER"
"""Environment variable of every worker: its scratch folder. It tells whose a process is."""
log = logging.getLogger(__name__)

_NUMERIC_LIBRARIES = ("OMP", "OPENBLAS", "MKL", "BLIS", "NUMEXPR", "VECLIB_MAXIMUM")


class Launcher(Protocol):
    """Starts worker processes."""

    level: int
    """Confinement level, as payloads ask for it."""
    name: str
    """What it is called in status."""

    def launch(self, spec: WorkerSpec, sock: socket.socket) -> WorkerProcess:
        """Start a worker on its end of the link; the caller closes `sock`.

        Call it on the thread of the loop: the worker ends when that thread does. Raises
        `WorkerFailed` (LAUNCH_FAILED).
        """
        ...

    def warm(self) -> None:
        """Prepare for the next launch what can be. Blocks for some milliseconds, never raises."""
        ...

    def close(self) -> None:
        """Give up what was prepared."""
        ...


class RlimitLauncher:
    """Holds workers with resource limits only."""

    level = 0
    name = "resource limits"

    def __init__(self, cages: Cages | None = None) -> None:
        self._cages = cages
        self._spare: Spare | None = None

    def launch(self, spec: WorkerSpec, sock: socket.socket) -> WorkerProcess:
        """Start a worker (see `Launcher`), from the spare interpreter if there is one."""
        spare, self._spare = self._spare, None
        try:
            spec.scratch.mkdir(parents=True, exist_ok=True, mode=0o700)
            parameters = _parameters(spec)
            if spare is not None and spare.python == spec.python:
                spare.limit(spec.limits)
                if spare.become(parameters, sock):
                    return WorkerProcess(spare.popen, spare.cage)
            elif spare is not None:
                spare.close()
            started = Spare(spec.python, self._cages)
            started.limit(spec.limits)
            if started.become(parameters, sock):
                return WorkerProcess(started.popen, started.cage)
        except OSError as error:
            problem = Problem("LAUNCH_FAILED", str(error), where=spec.component)
            raise WorkerFailed(problem) from error
        text = f"{spec.python} ends at once"
        raise WorkerFailed(Problem("LAUNCH_FAILED", text, where=spec.component))

    def warm(self) -> None:
        """Have a spare interpreter."""
        if self._spare is None:
            try:
                self._spare = Spare(base_interpreter(), self._cages)
            except OSError as error:  # launching will tell, should it be lasting
                log.warning("no spare interpreter: %s", error)

    def close(self) -> None:
        """End the spare interpreter."""
        if self._spare is not None:
            self._spare.close()
            self._spare = None


def _parameters(spec: WorkerSpec) -> dict[str, Any]:
    """What `bootstrap.py` is told. Raises `OSError` when the mark finds no room."""
    mark = f"{MARK}={spec.scratch}"
    if len(os.fsencode(mark)) >= ROOM_BYTES:
        raise OSError(f"the path of the scratch folder is too long: {spec.scratch}")
    return {
        "host_pid": os.getpid(),
        "component": spec.component,
        "entry_point": spec.entry_point,
        "distribution": spec.distribution,
        "site_packages": [str(folder) for folder in spec.site_packages],
        "limits": asdict(spec.limits),
        "scratch": str(spec.scratch),
        "environment": _environment(spec),
        "mark": mark,
        "room": ROOM,
    }


def _environment(spec: WorkerSpec) -> dict[str, str]:
    threads = str(spec.limits.numeric_threads)
    return {
        "PATH": "/usr/local/bin:/usr/bin:/bin",
        "LANG": "C.UTF-8",
        "HOME": str(spec.scratch),
        "TMPDIR": str(spec.scratch),
        "MALLOC_ARENA_MAX": "2",
        MARK: str(spec.scratch),
        **{f"{library}_NUM_THREADS": threads for library in _NUMERIC_LIBRARIES},
    }

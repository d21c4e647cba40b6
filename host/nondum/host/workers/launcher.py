"""The seam of confinement: how a worker's process is started, and what then holds it.

Level 3 will be bubblewrap with cgroup limits, 2 a systemd service, 1 a user of its own with
Landlock. Here is what needs nothing of the system: resource limits, a session of its own, no new
privileges, nothing inherited but the link.
"""

from __future__ import annotations

import json
import os
import socket
import subprocess
from dataclasses import asdict
from pathlib import Path
from typing import Protocol

from nondum.host.workers.process import WorkerProcess
from nondum.host.workers.spec import WorkerSpec
from nondum.sdk.errors import Problem, WorkerFailed

BOOTSTRAP = Path(__file__).with_name("bootstrap.py")
MARK = "NONDUM_WORKER"
"""Environment variable of every worker: its scratch folder. It tells whose a process is."""
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


class RlimitLauncher:
    """Holds workers with resource limits only."""

    level = 0
    name = "resource limits"

    def launch(self, spec: WorkerSpec, sock: socket.socket) -> WorkerProcess:
        """Start a worker (see `Launcher`)."""
        try:
            spec.scratch.mkdir(parents=True, exist_ok=True, mode=0o700)
            popen = subprocess.Popen(
                [spec.python, "-I", "-S", "-B", "-u", BOOTSTRAP, _parameters(spec, sock.fileno())],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                bufsize=0,
                pass_fds=(sock.fileno(),),
                start_new_session=True,
                cwd=spec.scratch,
                env=_environment(spec),
            )
        except OSError as error:
            problem = Problem("LAUNCH_FAILED", str(error), where=spec.component)
            raise WorkerFailed(problem) from error
        return WorkerProcess(popen)


def _parameters(spec: WorkerSpec, descriptor: int) -> str:
    return json.dumps(
        {
            "fd": descriptor,
            "host_pid": os.getpid(),
            "component": spec.component,
            "entry_point": spec.entry_point,
            "distribution": spec.distribution,
            "site_packages": [str(folder) for folder in spec.site_packages],
            "limits": asdict(spec.limits),
        }
    )


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

"""How a worker's process is started: an interpreter on some ground, which then becomes a worker.

What holds it is the confinement's matter (`confinement.py`). All levels have a session of its
own, resource limits, no new privileges, and nothing inherited but the link.
"""

from __future__ import annotations

import asyncio
import errno
import logging
import os
import socket
from dataclasses import asdict
from pathlib import Path
from typing import Any, Protocol

from nondum.host.sandbox.cgroups import Cgroups
from nondum.host.sandbox.levels.bubblewrap import Ground
from nondum.host.workers import problems, scratch
from nondum.host.workers.confinement import Confinement, Entry
from nondum.host.workers.process import WorkerProcess
from nondum.host.workers.spare import PLACEHOLDER, PLACEHOLDER_BYTES, Spare
from nondum.host.workers.spec import Timing, WorkerSpec
from nondum.host.workers.unconfined import Unconfined
from nondum.sdk.errors import Problem, WorkerFailed
from nondum.wheelhouse.format.confinement import Level

MARK = "NONDUM_WORKER"
"""Environment variable of every worker: its scratch folder. It tells whose a process is."""
log = logging.getLogger(__name__)

_NUMERIC_LIBRARIES = ("OMP", "OPENBLAS", "MKL", "BLIS", "NUMEXPR", "VECLIB_MAXIMUM")


class Launcher(Protocol):
    """Starts worker processes."""

    level: Level
    """How its workers are confined."""

    async def launch(self, spec: WorkerSpec, sock: socket.socket) -> WorkerProcess:
        """Start a worker on its end of the link; the caller closes `sock`.

        The worker ends when the thread of the loop does. Raises
        `WorkerFailed` (LAUNCH_FAILED, LAUNCH_CROWDED, WORKER_HUNG).
        """
        ...

    async def warm(self) -> None:
        """Prepare for the next launch what can be. Never raises."""
        ...

    async def close(self) -> None:
        """Give up what was prepared."""
        ...


class WorkerLauncher:
    """Starts workers in one confinement, from a spare interpreter if there is one that will do."""

    def __init__(
        self,
        confinement: Confinement | None = None,
        cgroups: Cgroups | None = None,
        scratches: Path | None = None,
        startup_s: float = Timing().startup_s,
    ) -> None:
        """`scratches`, where all scratch folders are, lets the next daemon find what is left;
        `startup_s` is how long an interpreter may take until it can become a worker."""
        self._confinement = confinement or Unconfined()
        self._cgroups = cgroups
        self._owner = owner_mark(scratches) if scratches is not None else ""
        self._startup_s = startup_s
        self._spare: Spare | None = None
        self.level = self._confinement.level

    @property
    def spare_pid(self) -> int | None:
        """The process of the spare interpreter, if there is one."""
        return None if self._spare is None else self._spare.popen.pid

    async def launch(self, spec: WorkerSpec, sock: socket.socket) -> WorkerProcess:
        """Start a worker (see `Launcher`), from the spare interpreter if there is one."""
        said = ""
        try:
            spec.scratch.mkdir(parents=True, exist_ok=True, mode=0o700)
            ground = self._confinement.ground(spec)
            with self._confinement.entry(spec, ground) as entry:
                if os.geteuid() == 0:
                    await asyncio.to_thread(scratch.give, spec.scratch, entry.user or 0)
                told = parameters(spec, entry)
                for started in (self._taken(), None):
                    if started is not None and not started.serves(ground):
                        await started.end()
                        continue
                    spare = started or await self._started(ground)
                    try:
                        spare.limit(spec.limits)
                        if spare.become(told, sock, entry.ruleset):
                            if entry.user is not None and entry.maps_scratch:
                                await spare.scratch_mapped(entry.user, self._startup_s)
                            return spare.process(entry.user)
                    except BaseException:
                        await spare.end()
                        raise
                    await spare.end()
                    said = spare.said
        except TimeoutError as error:
            raise WorkerFailed(problems.overdue(spec.component, self._startup_s)) from error
        except OSError as error:
            problem = Problem("LAUNCH_FAILED", str(error), where=spec.component)
            if error.errno == errno.ETOOMANYREFS:
                problem = problems.launch_crowded(spec.component)
            raise WorkerFailed(problem) from error
        text = f"{spec.python} ends at once{f': {said}' if said else ''}"
        raise WorkerFailed(Problem("LAUNCH_FAILED", text, where=spec.component))

    async def warm(self) -> None:
        """Have a spare interpreter. One call at a time."""
        if self._spare is None:
            try:
                self._spare = await self._started(self._confinement.ground(None))
            except OSError as error:  # launching will tell, should it be lasting
                log.warning("no spare interpreter: %s", error)

    async def close(self) -> None:
        """End the spare interpreter."""
        if (spare := self._taken()) is not None:
            await spare.end()

    async def _started(self, ground: Ground) -> Spare:
        return await Spare.in_cgroup(
            self._confinement, ground, self._cgroups, self._owner, self._startup_s
        )

    def _taken(self) -> Spare | None:
        spare, self._spare = self._spare, None
        return spare


def owner_mark(scratches: Path) -> str:
    """Whose an interpreter is before it becomes a worker: this daemon's life."""
    return f"{scratches}:{os.getpid()}"


def parameters(spec: WorkerSpec, entry: Entry, *, looks: bool = False) -> dict[str, Any]:
    """The parameters of `bootstrap.py`; a process that `looks` only reports what it sees, and ends.

    Raises `OSError` when the mark is too long for its placeholder.
    """
    mark = f"{MARK}={spec.scratch}"
    if len(os.fsencode(mark)) >= PLACEHOLDER_BYTES:
        raise OSError(f"the path of the scratch folder is too long: {spec.scratch}")
    return {
        "component": spec.component,
        "entry_point": spec.entry_point,
        "distribution": spec.distribution,
        "site_packages": [str(folder) for folder in spec.site_packages],
        "limits": asdict(spec.limits),
        "scratch": str(spec.scratch),
        "environment": _environment(spec),
        "mark": mark,
        "mark_placeholder": PLACEHOLDER,
        "mounts": entry.mounts,
        "restrictions": entry.restrictions,
        "looks": looks,
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

"""What a worker is started from: code, place, limits, and what it is expected to say."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import field
from pathlib import Path
from typing import Any

from nondum.host.sandbox.cgroups import CgroupLimits
from nondum.planning.merge.contribution import object_name
from nondum.sdk.description import PluginDescription
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.format.limits import WorkerLimits


@frozen
class Limits:
    """What one worker may use."""

    memory_mb: int = 2048
    """Private writable memory."""
    tasks: int = 256
    """Processes and threads. Has no effect on a worker of root."""
    descriptors: int = 1024
    file_mb: int = 1024
    """Size of one file that it writes."""
    core_mb: int = 0
    """Size of a core file: memory may hold secrets."""
    cpu_s: int | None = None
    """Processor seconds in all; None: no limit, since workers live long."""
    numeric_threads: int = 1
    """Threads that each numeric library may start for itself."""
    processors: float = 0.0
    """Processor seconds in a second, of all its processes; 0: no limit."""
    scratch_mb: int = 256
    """Size of its scratch folder."""

    def of_cgroup(self) -> CgroupLimits:
        """What all its processes may use together."""
        return CgroupLimits(self.memory_mb, self.tasks, processors=self.processors)


@frozen
class Timing:
    """How long a worker is waited for, in seconds."""

    startup_s: float = 30.0
    """From launch until the plugin has started."""
    heartbeat_s: float = 2.0
    """Between two signs of life."""
    missed: int = 3
    """Heartbeats in a row that may be missed before the worker counts as hung."""
    settle_beats: int = 2
    """Heartbeats that a release is watched for before it takes over from another one."""
    halt_s: float = 2.0
    """From asking a behaviour to halt until its worker is ended for not obeying."""
    term_s: float = 0.5
    """From SIGTERM to SIGKILL."""
    backoff_s: float = 1.0
    """From a crash to the first restart; doubled for each further one."""
    look_s: float = 2.0
    """Between two looks at what a worker uses."""
    spin_s: float = 10.0
    """How long a worker that runs no behaviour and feeds no stream may keep a processor busy."""
    spare_s: float = 2.0
    """From a launch until the next one is prepared."""

    @property
    def silence_s(self) -> float:
        """Silence after which a worker counts as hung."""
        return self.heartbeat_s * self.missed


@frozen
class WorkerSpec:
    """One component's worker."""

    component: str
    payload: str
    """Key of the payload."""
    distribution: str
    entry_point: str
    """`module:attribute` or `module`."""
    site_packages: tuple[Path, ...]
    """Folders that are appended to the interpreter's own path."""
    python: Path
    """The base interpreter, never a venv's."""
    scratch: Path
    """A folder of the component's own; made at launch."""
    index: PluginDescription
    """What the payload's index says of the plugin."""
    settings: Mapping[str, Any] = field(default_factory=dict)
    permissions: tuple[str, ...] = ()
    limits: Limits = Limits()
    asked: WorkerLimits = WorkerLimits()
    """What its payload asked for and was granted; in `limits` already but for the start."""
    shown: Path | None = None
    """Folder of the data that it is shown; None: it asks for none."""

    @property
    def readable(self) -> tuple[Path, ...]:
        """Folders of the host that its worker may read."""
        return (*self.site_packages, *((self.shown,) if self.shown else ()))

    @property
    def package(self) -> str:
        """Name of the plugin's own package or module."""
        return self.entry_point.partition(":")[0].partition(".")[0]

    def units(self, host: str) -> dict[str, str]:
        """Local name of each unit → its object."""
        return {u.name: object_name(host, self.component, u.name) for u in self.index.units}

    def outputs(self, host: str) -> dict[str, str]:
        """Each output slot → its stream object."""
        slots = (output.name for unit in self.index.units for output in unit.outputs)
        return {slot: object_name(host, self.component, slot) for slot in slots}


def base_interpreter() -> Path:
    """The interpreter that this one's venv was made from, or this one."""
    return Path(getattr(sys, "_base_executable", None) or sys.executable)

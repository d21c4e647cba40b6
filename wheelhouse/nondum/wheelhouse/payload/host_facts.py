"""What a host is and has, which a payload must fit: looked at here, or of a kind of hosts."""

from __future__ import annotations

import functools
import platform
from collections.abc import Mapping
from importlib import metadata
from pathlib import Path
from types import MappingProxyType

from packaging import markers, tags
from packaging.tags import Tag

from nondum.sdk.frozen import frozen
from nondum.wheelhouse.format.confinement import Level
from nondum.wheelhouse.format.limits import WorkerLimits
from nondum.wheelhouse.format.manifest import GPU_KINDS
from nondum.wheelhouse.format.target import Target
from nondum.wheelhouse.payload import memory
from nondum.wheelhouse.payload.gpu import Gpu
from nondum.wheelhouse.payload.memory import Memory
from nondum.wheelhouse.store import disk

_PLENTY_MB = 2**40
_NO_BOUND = WorkerLimits()


@frozen
class HostFacts:
    """What a host is and has."""

    architecture: str
    """As `uname -m` says."""
    python: str
    """Full version of the interpreter that workers run."""
    environment: Mapping[str, str]
    """Environment markers (PEP 508)."""
    tags: tuple[Tag, ...]
    """Wheel tags that it takes, best first."""
    free_disk_mb: int
    """On the store's file system, less the reserve."""
    memory: Memory
    confinement: Level
    """Level at which workers run here."""
    nondum: str
    """Version of nondum."""
    reserve_mb: int = 0
    """Disk that is left free, whatever comes: `install.reserve_mb`."""
    most: WorkerLimits = WorkerLimits()
    """The most that a worker may ask for: `most_…` under `[workers]`."""


def probe(
    state: Path, *, reserve_mb: int, confinement: Level, most: WorkerLimits = _NO_BOUND
) -> HostFacts:
    """Look at this machine. `state` is where the store is, or will be."""
    return HostFacts(
        architecture=platform.machine(),
        python=platform.python_version(),
        environment=_environment(),
        tags=_tags(),
        free_disk_mb=disk.free_mb(state, reserve_mb),
        memory=memory.look(),
        confinement=confinement,
        nondum=nondum_version(),
        reserve_mb=reserve_mb,
        most=most,
    )


def of_target(target: Target) -> HostFacts:
    """A host of some kind, as payloads are built for; what it has is not known, and enough."""
    version = tuple(int(part) for part in target.python.split("."))
    platforms = list(target.platforms())
    interpreter = "cp" + "".join(map(str, version))
    return HostFacts(
        architecture=target.architecture,
        python=f"{target.python}.0",
        environment={
            **_environment(),
            "implementation_name": "cpython",
            "implementation_version": f"{target.python}.0",
            "os_name": "posix",
            "platform_machine": target.architecture,
            "platform_python_implementation": "CPython",
            "platform_system": "Linux",
            "python_full_version": f"{target.python}.0",
            "python_version": target.python,
            "sys_platform": "linux",
        },
        tags=(
            *tags.cpython_tags(version, platforms=platforms),
            *tags.compatible_tags(version, interpreter, platforms),
        ),
        free_disk_mb=_PLENTY_MB,
        memory=Memory(_PLENTY_MB, Gpu(_PLENTY_MB, _PLENTY_MB, kinds=GPU_KINDS)),
        confinement=Level.SANDBOXED,
        nondum=nondum_version(),
    )


# What stays as it is while a process lives is looked at once: all of it takes ten milliseconds.


@functools.cache
def _environment() -> Mapping[str, str]:
    return MappingProxyType({k: str(v) for k, v in markers.default_environment().items()})


@functools.cache
def _tags() -> tuple[Tag, ...]:
    return tuple(tags.sys_tags())


@functools.cache
def nondum_version() -> str:
    """The version of nondum that runs here."""
    return metadata.version("nondum")

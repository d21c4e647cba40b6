"""Collects the rows of the report on a machine, and formats them as Markdown."""

from __future__ import annotations

import os
import platform
import shutil
import tempfile
from collections.abc import Callable, Iterable, Iterator
from importlib import metadata
from pathlib import Path
from typing import Any, TypeAlias

from nondum.cli.board import disk_speed, hardware
from nondum.cli.examination import clock
from nondum.host.config.host_config import HostConfig
from nondum.host.sandbox.cgroups import Cgroups
from nondum.host.sandbox.levels import landlock
from nondum.host.workers import confinement_probe
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.payload import gpu

ROOT = Path("/")
_COMMENT = "What `nondum doctor --board` says. Nothing in it names the machine or its people."


@frozen
class Row:
    """One thing that matters."""

    what: str
    here: str

    def to_dict(self) -> dict[str, Any]:
        """Plain data for people's tools."""
        return {"what": self.what, "here": self.here}


Part: TypeAlias = Callable[[HostConfig], Iterable[Row]]


def rows(config: HostConfig, root: Path = ROOT) -> Iterator[Row]:
    """Look at everything; takes seconds, most of them for the disk and for confinement."""
    yield Row("nondum", metadata.version("nondum"))
    yield Row("board", hardware.model(root))
    yield Row("processors", hardware.processors(root))
    yield Row("memory", hardware.memory(root))
    yield Row("system", hardware.system(root))
    page = os.sysconf("SC_PAGE_SIZE")
    yield Row("kernel", f"{platform.release()} {platform.machine()}, pages of {page} bytes")
    libc = " ".join(filter(None, platform.libc_ver())) or hardware.UNKNOWN
    yield Row("Python", f"{platform.python_version()}, {libc}")
    yield from _confinement()
    yield Row("USB", hardware.usb_buses(root))
    yield Row("GPU", _gpu(root))
    yield from (Row("clock", finding.detail) for finding in clock.examine(config))
    yield Row("real-time clock", hardware.real_time_clock(root))
    yield Row("temperature", hardware.temperature(root))
    yield from _disk(config, root)


def markdown(told: Iterable[Row]) -> str:
    """A table to paste into an issue.

    >>> print(markdown([Row("board", "Pi | 4")]).splitlines()[-1])
    | board | Pi \\| 4 |
    """
    lines = (f"| {row.what} | {row.here.replace('|', chr(92) + '|')} |" for row in told)
    return "\n".join((_COMMENT, "", "| what | here |", "|---|---|", *lines))


def _confinement() -> Iterator[Row]:
    cgroups = Cgroups.open(Path(tempfile.gettempdir()) / f"nondum-board-{os.getpid()}")
    held = ", ".join(sorted(cgroups.holds)) or "nothing is held"
    yield Row("control groups", f"{cgroups.kind}: {held}")
    cgroups.close()
    yield Row("Landlock", f"ABI {landlock.version()}" if landlock.version() else "none")
    for found in confinement_probe.all_findings():
        told = "works" if found.is_available else found.reason
        yield Row(f"level {found.level}", told)


def _gpu(root: Path) -> str:
    found = gpu.look(0, 0, root=root)
    if found is None:
        memory = "none that is known of"
    elif found.is_shared:
        memory = "the system's memory"
    else:
        memory = f"{found.free_mb} of {found.total_mb} MB free"
    kinds = ", ".join(found.kinds) if found is not None and found.kinds else "none"
    return f"{memory}; kinds: {kinds}; drivers: {hardware.graphics(root)}"


def _disk(config: HostConfig, root: Path) -> Iterator[Row]:
    state = config.host.state
    there = next(one for one in (state, *state.parents) if os.access(one, os.F_OK))
    device = there.stat().st_dev
    numbers = os.major(device), os.minor(device)
    free_gb = shutil.disk_usage(there).free / 1e9
    kind = hardware.file_system(root, numbers)
    yield Row("disk of the state", f"{hardware.disk(root, numbers)}; {kind}; {free_gb:.0f} GB free")
    try:
        yield Row("its speed", str(disk_speed.measure(there)))
    except OSError as error:
        yield Row("its speed", f"not measured: {error.strerror or error}")

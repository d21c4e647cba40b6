"""Device nodes that permissions and declared devices stand for, and who may open them."""

from __future__ import annotations

import contextlib
import stat
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path

from nondum.host.sandbox.levels import bubblewrap
from nondum.host.workers.spec import WorkerSpec

NODES: Mapping[str, tuple[str, ...]] = {
    "audio": ("/dev/snd",),
    "gpu": (
        *("/dev/dri", "/dev/kfd", "/dev/nvidia*"),
        *("/dev/nvhost-*", "/dev/nvgpu", "/dev/nvmap", "/dev/nvsciipc"),  # a Jetson's
    ),
}
"""Device nodes that a permission stands for."""
INSTRUMENTS = (
    *("/dev/pts", "/dev/bus/usb", "/dev/ttyUSB*", "/dev/ttyACM*", "/dev/video*"),
    *("/dev/hidraw*", "/dev/i2c-*", "/dev/spidev*", "/dev/gpiochip*", "/dev/media*"),
)
"""Where no sandbox can be made for a worker, what one that declares devices may open."""


def groups_of(nodes: Collection[str]) -> set[int]:
    """Groups, other than root's, that may open some of these nodes, or of those that are in these
    folders: `dialout`, `video`, …"""
    found = set()
    for node in (each for name in nodes for each in (Path(name), *Path(name).glob("*"))):
        with contextlib.suppress(OSError):
            about = node.stat()
            if about.st_mode & stat.S_IRGRP and not stat.S_ISDIR(about.st_mode):
                found.add(about.st_gid)
    return found - {0}


def instruments() -> Iterator[str]:
    """Those of the machine, as far as they are there by now, and those that the helper makes nodes
    for."""
    yield from _existing(INSTRUMENTS)
    yield from (place for place in bubblewrap.places_of_nodes() if place != "/dev")


def nodes_of(spec: WorkerSpec) -> Iterator[str]:
    """Those that a worker's permissions stand for."""
    for permission in sorted(spec.permissions):
        yield from _existing(NODES.get(permission, ()))


def _existing(patterns: Collection[str]) -> Iterator[str]:
    for pattern in patterns:
        yield from sorted(map(str, Path("/").glob(pattern.lstrip("/"))))

"""How the machine is that a host runs on: battery, disk, temperature and load, as far as it tells.

See Documentation/ABI/testing/sysfs-class-power and sysfs-class-thermal of Linux, statvfs(3) and
proc_loadavg(5).
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from nondum.sdk.codec.values import to_plain
from nondum.sdk.frozen import frozen

MEGABYTE = 1 << 20
LOW_PERCENT = 20
"""A battery with no more than that is low."""
LOW_MB = 256
"""Disk that is little, beside what is kept free: one payload with wheels may take more."""
HOT_C = 85.0
"""Hot, whatever the machine says that it can take: most have slowed down by then."""
MARGIN_C = 10.0
"""Below what it can take, where it says that."""
BUSY = 2.0
"""Processes that would run, for each processor, over five minutes: from then on all is slow."""
_LIKELY_C = (-50.0, 200.0)
"""A sensor that says anything else is not there, or broken."""
_LIMITS = frozenset({"hot", "critical"})


@frozen
class Battery:
    """A battery that the machine runs on."""

    name: str
    percent: int | None
    """How full it is; None: it does not tell."""
    state: str
    """`charging`, `discharging`, `full`, `not charging`, `unknown`: the kernel's words."""


@frozen
class Disk:
    """The disk that the host's state is on."""

    path: str
    free_mb: int
    """What is free for programs without privileges."""
    size_mb: int
    reserve_mb: int
    """What is kept free, whatever is plugged in."""


@frozen
class Temperature:
    """What a thermal zone says."""

    name: str
    celsius: float
    limit: float | None
    """Where the kernel takes measures to save the machine; None: it does not tell."""

    @property
    def is_hot(self) -> bool:
        """Whether it is too near to what the machine can take."""
        near = HOT_C if self.limit is None else min(HOT_C, self.limit - MARGIN_C)
        return self.celsius >= near


@frozen
class Load:
    """How many processes run or would, on average."""

    one_min: float
    five_min: float
    fifteen_min: float
    processors: int


@frozen
class Machine:
    """How it is now; what it does not tell is not there."""

    batteries: tuple[Battery, ...] = ()
    disk: Disk | None = None
    temperatures: tuple[Temperature, ...] = ()
    load: Load | None = None

    def warnings(self) -> Iterator[str]:
        """What is bad, and what to do."""
        if self.batteries and all(map(_is_low, self.batteries)):
            told = ", ".join(f"{b.name} {b.percent} %" for b in self.batteries)
            yield f"the battery is low ({told}): charge it"
        if self.disk is not None:
            yield from _of_disk(self.disk)
        for zone in self.temperatures:
            if zone.is_hot:
                told = f"the machine is hot ({zone.name} {zone.celsius:.0f} °C)"
                yield f"{told}: cool it, or give it less to do"
        if self.load is not None and self.load.five_min > BUSY * self.load.processors:
            told = f"the machine is overloaded (load {self.load.five_min:.1f} over five minutes"
            yield f"{told}, {self.load.processors} processors): all takes longer"

    def to_dict(self) -> dict[str, Any]:
        """Plain data for people's tools."""
        return {**to_plain(self), "warnings": list(self.warnings())}


def look(
    state: Path, reserve_mb: int, *, sys: Path = Path("/sys"), proc: Path = Path("/proc")
) -> Machine:
    """Look at the machine; blocks for some milliseconds. `state` is a folder on the disk that
    counts, of which `reserve_mb` are kept free."""
    return Machine(
        batteries=tuple(_batteries(sys / "class/power_supply")),
        disk=_disk(state, reserve_mb),
        temperatures=tuple(_temperatures(sys / "class/thermal")),
        load=_load(proc / "loadavg"),
    )


def _of_disk(disk: Disk) -> Iterator[str]:
    left_mb = disk.free_mb - disk.reserve_mb
    free = f"{disk.free_mb} MB are free at {disk.path}, of which {disk.reserve_mb} MB are kept free"
    if left_mb <= 0:
        yield f"the disk has no space for payloads ({free}): none is installed until there is"
    elif left_mb < LOW_MB:
        yield f"the disk has space for {left_mb} MB of payloads ({free}): one may need more"


def _is_low(battery: Battery) -> bool:
    is_used = battery.state not in ("charging", "full")
    return is_used and battery.percent is not None and battery.percent <= LOW_PERCENT


def _batteries(folder: Path) -> Iterator[Battery]:
    for supply in _entries(folder):
        # `Device`: it is in a mouse, say, and not what the machine runs on.
        is_its_own = _text(supply / "scope") != "Device" and _text(supply / "present") != "0"
        if _text(supply / "type") == "Battery" and is_its_own:
            state = _text(supply / "status").lower() or "unknown"
            yield Battery(supply.name, _percent(supply), state)


def _percent(supply: Path) -> int | None:
    told = _number(supply / "capacity")
    for kind in ("energy", "charge"):
        now, full = _number(supply / f"{kind}_now"), _number(supply / f"{kind}_full")
        if told is None and now is not None and full:
            told = round(100 * now / full)
    return None if told is None else max(0, min(100, told))


def _temperatures(folder: Path) -> Iterator[Temperature]:
    for zone in _entries(folder):
        if not zone.name.startswith("thermal_zone"):
            continue
        told = _number(zone / "temp")
        if told is not None and _LIKELY_C[0] <= told / 1000 <= _LIKELY_C[1]:
            name = _text(zone / "type") or zone.name
            yield Temperature(name, told / 1000, min(_limits(zone), default=None))


def _limits(zone: Path) -> Iterator[float]:
    for kind in sorted(zone.glob("trip_point_*_type")):
        told = _number(kind.with_name(kind.name.removesuffix("type") + "temp"))
        if _text(kind) in _LIMITS and told is not None and 0 < told / 1000 <= _LIKELY_C[1]:
            yield told / 1000


def _disk(state: Path, reserve_mb: int) -> Disk | None:
    try:
        found = os.statvfs(state)
    except OSError:
        return None
    free, size = found.f_bavail * found.f_frsize, found.f_blocks * found.f_frsize
    return Disk(str(state), free // MEGABYTE, size // MEGABYTE, reserve_mb)


def _load(file: Path) -> Load | None:
    try:
        one, five, fifteen = map(float, _text(file).split()[:3])
    except ValueError:
        return None
    return Load(one, five, fifteen, os.cpu_count() or 1)


def _entries(folder: Path) -> list[Path]:
    try:
        return sorted(folder.iterdir())
    except OSError:
        return []


def _number(file: Path) -> int | None:
    try:
        return int(_text(file))
    except ValueError:
        return None


def _text(file: Path) -> str:
    try:
        return file.read_text(encoding="utf-8", errors="replace").strip()
    except OSError:  # not there, or the driver has nothing to tell now
        return ""

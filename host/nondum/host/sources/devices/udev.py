"""The machine's own devices, as udev (or, without it, the kernel) tells of them.

Only what hangs on a bus and has a node: no terminals and other devices that exist in the kernel
alone, and no block devices, which are drives. None is opened: what is told of them stands in sysfs.
"""

from __future__ import annotations

import asyncio
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pyudev

from nondum.host.core.events.event import Emit
from nondum.host.sources.devices.hardware import (
    Part,
    device_id,
    devices,
    is_physical,
    physical,
    record,
)
from nondum.host.sources.devices.source import Sightings
from nondum.host.sources.uevents import uevents


class UdevSource:
    """Watches udev; unclaimed devices are only looked at."""

    async def watch(self, emit: Emit) -> None:
        """Tell what is there, then what comes and goes (see `DeviceSource`)."""
        tree = Tree(Sightings(emit))
        with uevents(pyudev.Context()) as messages:
            tree.see_all(await asyncio.to_thread(_present))
            while True:
                heard = await messages.next()
                if heard is None:
                    tree.see_all(await asyncio.to_thread(_present))
                else:
                    tree.see(await asyncio.to_thread(_looked_at, heard))


class Tree:
    """All parts of devices that are there."""

    def __init__(self, sightings: Sightings) -> None:
        self._sightings = sightings
        self._groups: dict[str, dict[str, Part]] = {}
        """Device → path → part."""
        self._of: dict[str, str] = {}
        """Path → device."""

    def see_all(self, present: Iterable[Part]) -> None:
        """These parts are there, and no others."""
        self._groups, self._of = {}, {}
        for part in present:
            self._put(part.path, part)
        parts = (part for group in self._groups.values() for part in group.values())
        self._sightings.see_all(devices(parts))

    def see(self, changes: Iterable[tuple[str, Part | None]]) -> None:
        """Parts came or changed, by path, or (None) went. What came is told once all is known
        of it that is known by now; what went, at once."""
        touched: dict[str, None] = {}
        for path, part in changes:
            if part is None and path in self._of:
                device = self._of[path]
                self._put(path, None)
                self._tell(device)
                touched.pop(device, None)
            elif part is not None:
                touched[self._put(path, part)] = None
        for device in touched:
            self._tell(device)

    def _put(self, path: str, part: Part | None) -> str:
        before = self._of.pop(path, None)
        if before is not None:
            del self._groups[before][path]
        if part is None:
            return before or ""
        device = device_id(physical(part))
        self._of[path] = device
        self._groups.setdefault(device, {})[path] = part
        return device

    def _tell(self, device: str) -> None:
        group = self._groups.get(device)
        if not group:
            self._groups.pop(device, None)
        self._sightings.see(device, record(group.values()) if group else None)


def _present() -> list[Part]:
    """What is there now; takes tens of milliseconds where there is much."""
    listed = pyudev.Context().list_devices()
    return [_part(device) for device in listed if _is_ours(device)]


def _looked_at(heard: Iterable[Any]) -> list[tuple[str, Part | None]]:
    """What messages tell of parts, in their order."""
    return [
        (device.device_path, None if device.action == "remove" else _part(device))
        for device in heard
        if device.action == "remove" or _is_ours(device)
    ]


def _is_ours(device: Any) -> bool:
    if device.device_path.startswith("/devices/virtual/") or device.subsystem == "block":
        return False
    return bool(device.device_node) or device.device_type == "usb_interface"


def _part(device: Any) -> Part:
    """A device of pyudev's, and what it is a part of."""
    properties = {key: value for key, value in device.properties.items() if key not in _FLEETING}
    part = Part(
        device.device_path,
        device.subsystem or "",
        device.device_type or "",
        _is_on_bus(device.sys_path),
        properties,
    )
    above = device.parent
    if above is None or is_physical(part):
        return part
    return Part(part.path, part.subsystem, part.kind, part.is_on_bus, properties, _part(above))


def _is_on_bus(path: str) -> bool:
    """Whether its subsystem is one of sysfs's buses, and not one of its classes."""
    try:
        return Path(os.readlink(f"{path}/subsystem")).parent.name == "bus"  # noqa: PTH115  # as it is
    except OSError:  # it has none, or has just gone
        return False


_FLEETING = frozenset({"ACTION", "SEQNUM", "USEC_INITIALIZED", "SYNTH_UUID", "DEVPATH"})
"""Properties that tell of the message, not of the device."""

"""The machine's own devices, as udev (or, without it, the kernel) tells of them.

Only what hangs on a bus and has a node: no terminals and other devices that exist in the kernel
alone, and no block devices, which are drives.
"""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

import pyudev

from nondum.host.devices.source import Found, Sightings
from nondum.host.events import Emit
from nondum.host.uevents import uevents


class UdevSource:
    """Watches udev; unclaimed devices are only looked at."""

    async def watch(self, emit: Emit) -> None:
        """Tell what is there, then what comes and goes (see `DeviceSource`)."""
        sightings = Sightings(emit)
        with uevents(pyudev.Context()) as messages:
            sightings.see_all(await asyncio.to_thread(_present))
            while True:
                devices = await messages.next()
                if devices is None:
                    sightings.see_all(await asyncio.to_thread(_present))
                    continue
                for device in devices:
                    _look(device, sightings)


def _present() -> dict[str, Found]:
    """What is there now; takes tens of milliseconds where there is much."""
    devices = pyudev.Context().list_devices()
    return {device.device_path: _found(device) for device in devices if _is_ours(device)}


def _look(device: Any, sightings: Sightings) -> None:
    is_there = device.action != "remove" and _is_ours(device)
    sightings.see(device.device_path, _found(device) if is_there else None)


def _is_ours(device: Any) -> bool:
    if not device.device_node or device.subsystem == "block":
        return False
    return not device.device_path.startswith("/devices/virtual/")


def _found(device: Any) -> Found:
    properties = {key: value for key, value in device.properties.items() if key not in _FLEETING}
    return Found(Path(device.device_node), properties)


_FLEETING = frozenset({"ACTION", "SEQNUM", "USEC_INITIALIZED", "SYNTH_UUID", "DEVPATH"})
"""Properties that tell of the message, not of the device."""

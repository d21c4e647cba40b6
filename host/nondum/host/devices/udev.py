"""The machine's own devices, as udev (or, without it, the kernel) tells of them.

Only what hangs on a bus and has a node: no terminals and other devices that exist in the kernel
alone, and no block devices, which are drives.
"""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pyudev

from nondum.host.devices.source import Found, Sightings
from nondum.host.events import Emit

UDEV_RUNS = Path("/run/udev/control")


class UdevSource:
    """Watches udev; unclaimed devices are only looked at."""

    async def watch(self, emit: Emit) -> None:
        """Tell what is there, then what comes and goes (see `DeviceSource`)."""
        monitor = pyudev.Monitor.from_netlink(pyudev.Context(), _voice())
        monitor.start()
        ready = asyncio.Event()
        loop = asyncio.get_running_loop()
        loop.add_reader(monitor.fileno(), ready.set)
        sightings = Sightings(emit)
        try:
            sightings.see_all(await asyncio.to_thread(_present))
            while True:
                await ready.wait()
                ready.clear()
                for device in _received(monitor):
                    _look(device, sightings)
        finally:
            loop.remove_reader(monitor.fileno())


def _voice() -> str:
    return "udev" if UDEV_RUNS.exists() else "kernel"


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


def _received(monitor: Any) -> Iterator[Any]:
    while (device := monitor.poll(timeout=0)) is not None:
        yield device

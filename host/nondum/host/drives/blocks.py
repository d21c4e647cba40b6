"""Block devices: USB drives as udev (or, without it, the kernel) tells of them. Needs root."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pyudev

from nondum.host.events import DriveInserted, DriveRemoved, DrivesScanned, Emit

UDEV_RUNS = Path("/run/udev/control")

Accepts = Callable[[pyudev.Device], bool]


def is_usb_drive(device: pyudev.Device) -> bool:
    """Whether a block device hangs on USB: fixed disks are never touched."""
    return device.properties.get("ID_BUS") == "usb" or "/usb" in device.sys_path


def udev_runs() -> bool:
    """Whether udevd is there to tell of devices."""
    return UDEV_RUNS.exists()


class BlockSource:
    """Watches block devices that `accepts` lets through; each with a file system is a drive."""

    kind = "block"

    def __init__(self, mounts: Path, *, accepts: Accepts = is_usb_drive) -> None:
        self._mounts = mounts
        self._accepts = accepts
        self._seen: dict[str, str] = {}
        """sysfs path → drive."""

    async def watch(self, emit: Emit) -> None:
        """Tell what is there, then what comes and goes, until cancelled."""
        context = pyudev.Context()
        # Without udevd only the kernel's own messages arrive; they carry no file system.
        source = "udev" if udev_runs() else "kernel"
        monitor = pyudev.Monitor.from_netlink(context, source)
        monitor.filter_by("block")
        monitor.start()
        ready = asyncio.Event()
        loop = asyncio.get_running_loop()
        loop.add_reader(monitor.fileno(), ready.set)
        try:
            for device in context.list_devices(subsystem="block"):
                self._look(device, emit)
            emit(DrivesScanned(self.kind, tuple(self._seen.values())))
            while True:
                await ready.wait()
                ready.clear()
                for device in _received(monitor):
                    self._look(device, emit)
        finally:
            loop.remove_reader(monitor.fileno())

    def _look(self, device: pyudev.Device, emit: Emit) -> None:
        """Compare one device with what was known of it."""
        drive = _drive(device) if self._is_drive(device) else None
        known = self._seen.get(device.sys_path)
        if known is not None and known != drive:
            del self._seen[device.sys_path]
            emit(DriveRemoved(known))
        if drive is not None and known != drive:
            self._seen[device.sys_path] = drive
            emit(
                DriveInserted(
                    drive,
                    self._mounts / drive,
                    self.kind,
                    node=Path(device.device_node),
                    filesystem=device.properties.get("ID_FS_TYPE", ""),
                )
            )

    def _is_drive(self, device: pyudev.Device) -> bool:
        if device.action == "remove" or not device.device_node or not _size(device):
            return False
        if device.device_type == "disk" and _has_partitions(device):
            return False
        if udev_runs() and "ID_FS_TYPE" not in device.properties:
            return False
        return self._accepts(device)


def _received(monitor: Any) -> Iterator[pyudev.Device]:
    while (device := monitor.poll(timeout=0)) is not None:
        yield device


def _drive(device: pyudev.Device) -> str:
    """Kernel name and insertion number: the next stick in the same port is another drive."""
    number = device.properties.get("DISKSEQ")
    return f"{device.sys_name}-{number}" if number else str(device.sys_name)


def _size(device: pyudev.Device) -> int:
    try:
        return int((Path(device.sys_path) / "size").read_text())
    except (OSError, ValueError):
        return 0


def _has_partitions(device: pyudev.Device) -> bool:
    return any(Path(device.sys_path).glob("*/partition"))

"""Block devices: USB drives as udev (or, without it, the kernel) tells of them. Needs root."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pyudev

from nondum.host.events import DriveInserted, DriveRemoved, DrivesScanned, Emit
from nondum.host.uevents import udev_runs, uevents

Accepts = Callable[[pyudev.Device], bool]


def is_usb_drive(device: pyudev.Device) -> bool:
    """Whether a block device hangs on USB: fixed disks are never touched."""
    return device.properties.get("ID_BUS") == "usb" or "/usb" in device.sys_path


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
        with uevents(context, "block") as messages:
            self._look_at_all(context, emit)
            emit(DrivesScanned(self.kind, tuple(self._seen.values())))
            while True:
                devices = await messages.next()
                if devices is None:
                    self._look_at_all(context, emit)
                    continue
                for device in devices:
                    self._look(device, emit)

    def _look_at_all(self, context: pyudev.Context, emit: Emit) -> None:
        """Compare what is there now with what was known."""
        present = {d.sys_path: d for d in context.list_devices(subsystem="block")}
        for path in self._seen.keys() - present.keys():
            emit(DriveRemoved(self._seen.pop(path)))
        for device in present.values():
            self._look(device, emit)

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

"""Block devices: USB drives as udev (or, without it, the kernel) tells of them. Needs root."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import pyudev

from nondum.host.drives import usb
from nondum.host.drives.nodes import drive_name
from nondum.host.events import DriveInserted, DriveRemoved, DrivesScanned, Emit
from nondum.host.uevents import udev_runs, uevents
from nondum.sdk.errors import Problem

Accepts = Callable[[pyudev.Device], bool]

SYSFS = Path("/sys")
MARKS = ("ID_SERIAL", "PARTN", "ID_FS_UUID")
"""Properties of udev by which a drive is known again."""
MOST_MARK = 200


def is_usb_drive(device: pyudev.Device) -> bool:
    """Whether a block device hangs on USB: fixed disks are never touched."""
    return device.properties.get("ID_BUS") == "usb" or "/usb" in device.sys_path


class BlockSource:
    """Watches block devices that `accepts` lets through; each with a file system is a drive."""

    kind = "block"

    def __init__(
        self,
        mounts: Path,
        *,
        accepts: Accepts = is_usb_drive,
        single_function: bool = True,
        sysfs: Path = SYSFS,
    ) -> None:
        """`single_function`: refuse what is something else beside a drive, as `sysfs` has it."""
        self._mounts, self._accepts = mounts, accepts
        self._single_function, self._sysfs = single_function, sysfs
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
                    if device.device_type == "partition" and device.parent is not None:
                        self._look(device.parent, emit)  # it may have been taken for a drive
                    self._look(device, emit)

    def _look_at_all(self, context: pyudev.Context, emit: Emit) -> None:
        """Compare what is there now with what was known."""
        present = {d.sys_path: d for d in context.list_devices(subsystem="block")}
        for path in sorted(self._seen.keys() - present.keys()):
            emit(DriveRemoved(self._seen.pop(path)))
        for path in sorted(present):
            self._look(present[path], emit)

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
                    problems=self._problems(device, drive),
                    port=usb.port_of(Path(device.sys_path)),
                    mark=mark_of(device.properties),
                )
            )

    def _problems(self, device: pyudev.Device, drive: str) -> tuple[Problem, ...]:
        """What keeps it from being read at all."""
        if not self._single_function:
            return ()
        block = self._sysfs / Path(device.sys_path).relative_to(SYSFS)
        return usb.extra_interfaces(block, where=drive)

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
    disk = Path(device.sys_path)
    if device.device_type == "partition":
        disk = disk.parent
    return drive_name(device.sys_name, _number(disk / "diskseq"))


def mark_of(properties: Mapping[str, str]) -> str:
    """What a drive is by its own word, as udev has read it: serial number, partition, file system.

    >>> mark_of({"ID_SERIAL": "Acme_Stick_0042", "ID_FS_UUID": "1C2D-3E4F"})
    'Acme_Stick_0042/1C2D-3E4F'
    >>> mark_of({})
    ''
    """
    said = [properties.get(name, "") for name in MARKS]
    return "/".join(filter(None, said))[:MOST_MARK]


def _size(device: pyudev.Device) -> int:
    return _number(Path(device.sys_path) / "size") or 0


def _number(attribute: Path) -> int | None:
    """An attribute of sysfs; None: the kernel has it not, or the device is gone."""
    try:
        return int(attribute.read_text(encoding="ascii"))
    except (OSError, ValueError):
        return None


def _has_partitions(device: pyudev.Device) -> bool:
    return any(Path(device.sys_path).glob("*/partition"))

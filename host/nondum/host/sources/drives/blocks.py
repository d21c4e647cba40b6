"""Block devices: USB drives as udev (or, without it, the kernel) tells of them. Needs root."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import pyudev

from nondum.host.core.events.drives import (
    DriveInserted,
    DriveLeftAlone,
    DriveRemoved,
    DrivesScanned,
)
from nondum.host.core.events.event import Emit
from nondum.host.sandbox.helper.block_devices import Machine
from nondum.host.sandbox.helper.drive_nodes import drive_name, mounted_elsewhere
from nondum.host.sandbox.helper.mounting import unsupported
from nondum.host.sources.drives import usb
from nondum.host.sources.uevents import udev_runs, uevents
from nondum.sdk.errors import Problem

Accepts = Callable[[pyudev.Device], bool]
Known = tuple[str, str]
"""A drive's name, and its file system: a drive that is formatted again is told again."""

SYSFS = Path("/sys")
MARKS = ("ID_SERIAL", "PARTN", "ID_FS_UUID")
"""Properties of udev by which a drive is known again."""
MOST_MARK = 200
NO_FILES = frozenset(
    {
        *("0x5", "0xf", "0x85"),
        "e3c9e316-0b5c-4db8-817d-f92df00215ae",
        "21686148-6449-6e6f-744e-656564454649",
    }
)
"""Kinds of partitions that never hold files: extended ones, Microsoft's reserve, GRUB's."""


def is_usb_drive(device: pyudev.Device) -> bool:
    """Whether a block device hangs on USB: fixed disks are never touched."""
    return device.properties.get("ID_BUS") == "usb" or "/usb" in device.sys_path


class BlockSource:
    """Watches block devices that `accepts` lets through; each with a file system is a drive.

    What goes while it is looked at is none: that it is gone is told by the next message.
    """

    kind = "block"

    def __init__(
        self,
        mounts: Path,
        *,
        accepts: Accepts = is_usb_drive,
        single_function: bool = True,
        sysfs: Path = SYSFS,
        machine: Machine | None = None,
    ) -> None:
        """`single_function`: refuse what is something else beside a drive, as `sysfs` has it."""
        self._mounts, self._accepts = mounts, accepts
        self._single_function, self._sysfs = single_function, sysfs
        self._machine = machine or Machine()
        self._seen: dict[str, Known] = {}
        """sysfs path → drive."""
        self._left_alone: dict[str, str] = {}
        """sysfs path → what was told of once, and is none of this host's drives until it is
        plugged in again."""

    async def watch(self, emit: Emit) -> None:
        """Tell what is there, then what comes and goes, until cancelled."""
        context = pyudev.Context()
        with uevents(context, "block") as messages:
            self._look_at_all(context, emit)
            emit(DrivesScanned(self.kind, tuple(drive for drive, _ in self._seen.values())))
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
            emit(DriveRemoved(self._seen.pop(path)[0]))
        for path in self._left_alone.keys() - present.keys():
            del self._left_alone[path]
        for path in sorted(present):
            self._look(present[path], emit)

    def _look(self, device: pyudev.Device, emit: Emit) -> None:
        """Compare one device with what was known of it."""
        path = device.sys_path
        try:
            found = self._known(device)
        except OSError:
            found = None
        known = self._seen.get(path)
        if known is not None and known != found:
            del self._seen[path]
            emit(DriveRemoved(known[0]))
        if found is None or self._left_alone.get(path) != found[0]:
            self._left_alone.pop(path, None)
            if found is not None and known != found:
                self._tell(device, found, emit)

    def _tell(self, device: pyudev.Device, found: Known, emit: Emit) -> None:
        """Tell a drive that has just come."""
        drive, filesystem = found
        use = self._machine.uses(self._mounts).get(device.sys_name)
        if use is not None and use.is_own:
            self._left_alone[device.sys_path] = drive
            emit(DriveLeftAlone(drive, (_own(drive, use.why),)))
            return
        node = Path(device.device_node)
        try:
            problems = self._extra(device, drive)
        except OSError:
            return
        if not filesystem and udev_runs():
            text = "has no file system that is known"
            problems = (*problems, *unsupported(node, text, "none").problems)
        if use is not None:
            problems = (*problems, mounted_elsewhere(node, use.why))
        self._seen[device.sys_path] = found
        emit(
            DriveInserted(
                drive,
                self._mounts / drive,
                self.kind,
                node=node,
                filesystem=filesystem,
                problems=problems,
                port=usb.port_of(Path(device.sys_path)),
                mark=mark_of(device.properties),
            )
        )

    def _extra(self, device: pyudev.Device, drive: str) -> tuple[Problem, ...]:
        """What it is beside a drive. Raises `OSError` when it goes meanwhile."""
        if not self._single_function:
            return ()
        block = self._sysfs / Path(device.sys_path).relative_to(SYSFS)
        return usb.extra_interfaces(block, where=drive)

    def _known(self, device: pyudev.Device) -> Known | None:
        """What a device is as a drive; None: it is none. Raises `OSError` when it goes."""
        if device.action == "remove" or not device.device_node or not _size(device):
            return None
        if device.device_type == "disk" and _has_partitions(device):
            return None
        if udev_runs() and (not device.is_initialized or _holds_no_files(device.properties)):
            return None
        if not self._accepts(device):
            return None
        return _drive(device), device.properties.get("ID_FS_TYPE", "")


def _own(drive: str, why: str) -> Problem:
    return Problem(
        "DRIVE_OWN",
        f"is this machine's own, and left alone: {why}",
        where=drive,
        fix="`nondum doctor disks` tells which disks are whose",
    )


def _holds_no_files(properties: Mapping[str, str]) -> bool:
    return properties.get("ID_PART_ENTRY_TYPE", "") in NO_FILES


def _drive(device: pyudev.Device) -> str:
    """Kernel name and insertion number: the next stick in the same port is another drive."""
    if said := device.properties.get("DISKSEQ", ""):  # of the one that the message is about
        return drive_name(device.sys_name, int(said))
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

"""Which of the disks on USB are read as drives, and why the others are not."""

from __future__ import annotations

from collections.abc import Iterator

from nondum.host.config import HostConfig
from nondum.host.doctor.finding import Finding, ok, warn
from nondum.host.drives.uses import Machine
from nondum.host.drives.whose import Disk, Owner, disks
from nondum.host.helper.client import MOUNTS


def examine(config: HostConfig) -> Iterator[Finding]:
    """Look at what hangs on USB; other disks are never read."""
    found = [judge(disk) for disk in disks(Machine(), MOUNTS) if disk.is_usb]
    yield from found or [ok("drives", "no disk is plugged in")]


def judge(disk: Disk) -> Finding:
    """Whether what a person plugged in is read. Pure."""
    if disk.owner is Owner.SOMEBODY:
        told = f"it is not read: {disk.why}"
        return warn("drives", told, "unmount it, if it is a payload drive", subject=disk.name)
    told = {
        Owner.HOST: f"this machine's own, and left alone: {disk.why}",
        Owner.DRIVE: "read as a drive",
        Owner.NOBODY: disk.why,
    }[disk.owner]
    return ok("drives", told, subject=disk.name)

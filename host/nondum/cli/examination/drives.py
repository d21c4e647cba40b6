"""Which of the disks on USB are read as drives, and why the others are not."""

from __future__ import annotations

from collections.abc import Iterator

from nondum.cli.examination.finding import Finding, ok, warn
from nondum.host.config.host_config import HostConfig
from nondum.host.sandbox.helper.block_devices import Machine
from nondum.host.sandbox.helper.client import MOUNTS
from nondum.host.sources.drives.disk_report import Disk, Owner, disks


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
        Owner.NONE: disk.why,
    }[disk.owner]
    return ok("drives", told, subject=disk.name)

"""Which block devices the helper mounts: what was plugged in, and nothing that the machine uses."""

from __future__ import annotations

import stat
from dataclasses import field
from pathlib import Path

from nondum.host.sandbox.helper.block_devices import Machine
from nondum.host.sandbox.helper.drive_nodes import mounted_elsewhere
from nondum.host.sandbox.helper.mountinfo import device_number
from nondum.host.sandbox.helper.requests import refused
from nondum.sdk.errors import PayloadRefused
from nondum.sdk.frozen import frozen


@frozen
class Disks:
    """Judges block devices by sysfs(5), and by what the machine needs them for."""

    allow_loop: bool = False
    """Whether loop devices may stand for drives: root's word, for tests."""
    machine: Machine = field(default_factory=Machine)

    def node(self, device: str, diskseq: int | None, ours: Path) -> Path:
        """The node of a drive that may be mounted, and is mounted nowhere but below `ours`.

        Raises `NondumError` (HELPER_REFUSED), `PayloadRefused` (DRIVE_MOUNTED).
        """
        place = self.machine.sys / "class/block" / device
        if not place.is_dir():
            raise refused("there is no such block device", device)
        folder = place.resolve()
        if not self._is_pluggable(device):
            raise refused("it does not hang on USB: the machine's own disks are not drives", device)
        if _diskseq(folder) != diskseq:
            raise refused("it is not the one that was plugged in then", device)
        number = _number(folder)
        if any(folder.glob("*/partition")):
            raise refused("it has partitions: each is a drive", device)
        node = self.machine.dev / device
        if (use := self.machine.uses(ours).get(device)) is not None:
            if use.is_own:
                raise refused(f"it is the machine's own: {use.why}", device)
            raise PayloadRefused(mounted_elsewhere(node, use.why))
        found = node.stat()
        if not stat.S_ISBLK(found.st_mode) or found.st_rdev != number:
            raise refused("its node is another device's", device)
        return node

    def _is_pluggable(self, device: str) -> bool:
        if self.machine.is_on_usb(device):
            return True
        parts = self.machine.place(device)
        is_virtual = parts[:3] == ("devices", "virtual", "block")
        return self.allow_loop and is_virtual and parts[3].startswith("loop")


def _diskseq(folder: Path) -> int | None:
    for place in (folder, folder.parent):
        try:
            return int((place / "diskseq").read_text(encoding="ascii"))
        except (OSError, ValueError):
            continue
    return None


def _number(folder: Path) -> int:
    try:
        return device_number((folder / "dev").read_text(encoding="ascii"))
    except (OSError, ValueError):
        raise refused("it has just gone", folder.name) from None

"""Which block devices the helper mounts: what was plugged in, and nothing that the machine uses."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from nondum.host.helper.requests import refused

SYS = Path("/sys")
_BY = {
    "UUID": "by-uuid",
    "LABEL": "by-label",
    "PARTUUID": "by-partuuid",
    "PARTLABEL": "by-partlabel",
}


@dataclass(frozen=True, slots=True)
class Disks:
    """Judges block devices by sysfs(5), fstab(5) and what is mounted."""

    allow_loop: bool = False
    """Whether loop devices may stand for drives: root's word, for tests."""
    sys: Path = SYS
    fstab: Path = Path("/etc/fstab")
    proc: Path = Path("/proc")
    dev: Path = Path("/dev")

    def node(self, device: str, diskseq: int | None, ours: Path) -> Path:
        """The node of a drive that may be mounted, and is mounted nowhere but below `ours`.

        Raises `NondumError` (HELPER_REFUSED).
        """
        place = self.sys / "class/block" / device
        if not place.is_dir():
            raise refused("there is no such block device", device)
        folder = place.resolve()
        if not self._is_pluggable(folder):
            raise refused("it does not hang on USB: the machine's own disks are not drives", device)
        if _diskseq(folder) != diskseq:
            raise refused("it is not the one that was plugged in then", device)
        number = _number(folder)
        if reasons := tuple(self._uses(folder, number, ours)):
            raise refused(reasons[0], device)
        node = self.dev / device
        found = node.stat()
        if not stat.S_ISBLK(found.st_mode) or found.st_rdev != number:
            raise refused("its node is another device's", device)
        return node

    def _is_pluggable(self, folder: Path) -> bool:
        parts = folder.relative_to(self.sys.resolve()).parts
        if any(part.startswith("usb") and part[3:].isdigit() for part in parts):
            return True
        return (
            self.allow_loop
            and parts[:3] == ("devices", "virtual", "block")
            and (parts[3].startswith("loop"))
        )

    def _uses(self, folder: Path, number: int, ours: Path) -> Iterator[str]:
        """Why the machine needs it, or a part of it."""
        if any(folder.glob("holders/*")):
            yield "another device is made of it"
        if any(folder.glob("*/partition")):
            yield "it has partitions: each is a drive"
        if number in self._mounted(ours):
            yield "it is mounted already"
        if number in self._in_fstab():
            yield "the machine mounts it itself (/etc/fstab)"
        if number in self._swaps():
            yield "the machine swaps to it"

    def _mounted(self, ours: Path) -> set[int]:
        lines = (self.proc / "self/mountinfo").read_text(encoding="utf-8").splitlines()
        mounts = [line.split() for line in lines]
        return {_device(m[2]) for m in mounts if not m[4].startswith(f"{ours}/")}

    def _in_fstab(self) -> set[int]:
        try:
            lines = self.fstab.read_text(encoding="utf-8", errors="replace").splitlines()
        except OSError:
            return set()
        named = (line.split()[0] for line in lines if line.split() and not line.startswith("#"))
        return {number for spec in named for number in self._numbers(spec)}

    def _swaps(self) -> set[int]:
        try:
            lines = (self.proc / "swaps").read_text(encoding="utf-8").splitlines()[1:]
        except OSError:
            return set()
        return {number for line in lines for number in self._numbers(line.split()[0])}

    def _numbers(self, spec: str) -> Iterator[int]:
        """The device that a line of fstab names, if it is here."""
        tag, _, value = spec.partition("=")
        path = self.dev / "disk" / _BY[tag] / value.strip('"') if tag in _BY else Path(spec)
        try:
            found = path.stat()
        except (OSError, ValueError):
            return
        if stat.S_ISBLK(found.st_mode):
            yield found.st_rdev


def _diskseq(folder: Path) -> int | None:
    for place in (folder, folder.parent):
        try:
            return int((place / "diskseq").read_text(encoding="ascii"))
        except (OSError, ValueError):
            continue
    return None


def _number(folder: Path) -> int:
    try:
        return _device((folder / "dev").read_text(encoding="ascii").strip())
    except (OSError, ValueError):
        raise refused("it has just gone", folder.name) from None


def _device(text: str) -> int:
    major, _, minor = text.partition(":")
    return os.makedev(int(major), int(minor))

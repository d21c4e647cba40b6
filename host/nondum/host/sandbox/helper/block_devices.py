"""Looks up which block devices are needed, and what for. `own.py` says what it comes to."""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Iterator
from pathlib import Path, PurePosixPath

from nondum.host.sandbox.helper import system_disks
from nondum.host.sandbox.helper.mountinfo import Mount, device_number, mounts
from nondum.host.sandbox.helper.system_disks import Block, Named, Use
from nondum.sdk.frozen import frozen

UNITS = tuple(
    map(
        Path,
        (
            "/etc/systemd/system",
            "/run/systemd/system",
            "/run/systemd/generator.early",
            "/run/systemd/generator",
            "/run/systemd/generator.late",
            "/usr/local/lib/systemd/system",
            "/usr/lib/systemd/system",
        ),
    )
)
"""Where units are (systemd.unit(5)); not transient ones: those mount what somebody asked for."""
_UNIT = (".mount", ".swap")


@frozen
class Machine:
    """Where a machine tells of its disks: sysfs(5), proc(5), fstab(5), crypttab(5), udev's links,
    units of systemd.

    What is not there, cannot be read or goes meanwhile says nothing.
    """

    sys: Path = Path("/sys")
    proc: Path = Path("/proc")
    dev: Path = Path("/dev")
    etc: Path = Path("/etc")
    units: tuple[Path, ...] = UNITS

    def uses(self, ours: Path) -> dict[str, Use]:
        """What block devices are needed for, by their names, but for what is mounted below `ours`;
        those that are not in it are free."""
        direct: dict[int, Use] = {}
        for number, use in (*self._configured(), *self._mounted(ours)):
            if number not in direct or (use.is_own and not direct[number].is_own):
                direct[number] = use
        return system_disks.uses(self.blocks(), direct)

    def blocks(self) -> list[Block]:
        """The block devices there are."""
        return sorted(self._blocks(), key=lambda block: block.name)

    def sectors(self, name: str) -> int:
        """The size of a block device, in sectors of 512 bytes; 0: it has no medium, or is gone."""
        text = _text(self.sys / "class/block" / name / "size").strip()
        return int(text) if text.isdigit() else 0

    def is_on_usb(self, name: str) -> bool:
        """Whether a block device hangs on USB."""
        return any(re.fullmatch("usb[0-9]+", part) for part in self.place(name))

    def place(self, name: str) -> tuple[str, ...]:
        """The folders of sysfs that lead to a block device."""
        folder = (self.sys / "class/block" / name).resolve()
        return folder.relative_to(self.sys.resolve()).parts

    def _blocks(self) -> Iterator[Block]:
        try:
            names = [link.name for link in (self.sys / "class/block").iterdir()]
        except OSError:
            return
        for name in names:
            folder = (self.sys / "class/block" / name).resolve()
            try:
                number = device_number((folder / "dev").read_text(encoding="ascii"))
            except (OSError, ValueError):
                continue  # it has just gone
            disk = folder.parent.name if (folder / "partition").exists() else name
            yield Block(name, number, disk, _names(folder / "holders"))

    def _configured(self) -> Iterator[tuple[int, Use]]:
        for named in (
            *system_disks.in_fstab(_text(self.etc / "fstab")),
            *system_disks.in_crypttab(_text(self.etc / "crypttab")),
            *system_disks.in_swaps(_text(self.proc / "swaps")),
            *system_disks.in_command_line(_text(self.proc / "cmdline")),
            *(named for folder in self.units for named in _in_units(folder)),
        ):
            yield from self._numbered(named.path, Use(named.why))

    def _mounted(self, ours: Path) -> Iterator[tuple[int, Use]]:
        for mount, use in system_disks.mounted(_mounts(self.proc), PurePosixPath(ours.resolve())):
            yield mount.number, use
            if mount.source.startswith("/dev/"):
                yield from self._numbered(mount.source, use)

    def _numbered(self, path: str, use: Use) -> Iterator[tuple[int, Use]]:
        """The device that a path below /dev stands for, if it is here."""
        try:
            found = (self.dev / Path(path).relative_to("/dev")).stat()
        except (OSError, ValueError):
            return
        if stat.S_ISBLK(found.st_mode):
            yield found.st_rdev, use


def _in_units(folder: Path) -> Iterator[Named]:
    """What the units of a folder name, and what is dropped in for units, wherever those are."""
    for name in _names(folder):
        unit = name.removesuffix(".d")
        if not unit.endswith(_UNIT):
            continue
        if unit == name:
            yield from system_disks.in_unit(_text(folder / name), unit)
        else:
            for part in _names(folder / name):
                yield from system_disks.in_unit(_text(folder / name / part), unit)


def _mounts(proc: Path) -> tuple[Mount, ...]:
    try:
        return mounts(proc / "self/mountinfo")
    except OSError:
        return ()


def _names(folder: Path) -> tuple[str, ...]:
    try:
        with os.scandir(folder) as entries:
            return tuple(sorted(entry.name for entry in entries))
    except OSError:
        return ()


def _text(file: Path) -> str:
    try:
        return file.read_text(encoding="utf-8", errors="surrogateescape")
    except OSError:
        return ""

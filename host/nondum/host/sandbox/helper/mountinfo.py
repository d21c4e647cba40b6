"""What is mounted, as /proc/self/mountinfo tells it (proc_pid_mountinfo(5))."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path

from nondum.sdk.frozen import frozen

MOUNTINFO = Path("/proc/self/mountinfo")


@frozen
class Mount:
    """One mount."""

    number: int
    """The device; file systems of several devices have a separate number (btrfs)."""
    at: str
    """Where it is mounted."""
    source: str
    """The mount source, as mount(2) was given it: for most file systems the device's node."""


def parsed(text: str) -> Iterator[Mount]:
    """The mounts of a mountinfo; lines that are none are passed over.

    >>> next(parsed("36 35 8:17 / /media/my\\\\040stick ro - vfat /dev/sdb1 ro")).at
    '/media/my stick'
    """
    for line in text.splitlines():
        fields, _, rest = line.partition(" - ")
        place, said = fields.split(" "), rest.split(" ")
        try:
            yield Mount(device_number(place[2]), unescaped(place[4]), unescaped(said[1]))
        except (IndexError, ValueError):
            continue


def mounts(mountinfo: Path = MOUNTINFO) -> tuple[Mount, ...]:
    """What is mounted now. Raises `OSError`."""
    return tuple(parsed(mountinfo.read_text(encoding="utf-8", errors="surrogateescape")))


def mounted_below(folder: Path) -> list[Path]:
    """Mount points below a folder, innermost first."""
    base = folder.resolve()
    points = (Path(mount.at) for mount in mounts())
    return sorted((p for p in points if base in p.parents), reverse=True)


def device_number(text: str) -> int:
    """The number of a device as sysfs and mountinfo write it. Raises `ValueError`.

    >>> device_number("8:17") == os.makedev(8, 17)
    True
    """
    major, _, minor = text.strip().partition(":")
    try:
        return os.makedev(int(major), int(minor))
    except OverflowError as error:
        raise ValueError(text) from error


def unescaped(field: str) -> str:
    """A field of mountinfo or fstab, where blanks and backslashes are octal.

    >>> unescaped("/media/my\\\\040drive")
    '/media/my drive'
    """
    return re.sub(r"\\([0-7]{3})", lambda match: chr(int(match[1], 8)), field)

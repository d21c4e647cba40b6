"""Mount and unmount of drives, by mount(2) itself; needs root.

Read-only, without set-uid, devices, execution or symlinks; a dirty ext4 journal is not replayed.
"""

from __future__ import annotations

import ctypes
import os
import re
from collections.abc import Mapping
from pathlib import Path

from nondum.sdk.errors import DriveGone, PayloadRefused, Problem

MS_RDONLY = 0x1
MS_NOSUID = 0x2
MS_NODEV = 0x4
MS_NOEXEC = 0x8
MS_NOSYMFOLLOW = 0x100
MNT_DETACH = 0x2
UMOUNT_NOFOLLOW = 0x8

FLAGS = MS_RDONLY | MS_NOSUID | MS_NODEV | MS_NOEXEC | MS_NOSYMFOLLOW

FILESYSTEMS: Mapping[str, str] = {
    "vfat": "utf8",
    "exfat": "",
    "ext4": "noload",
    "ext3": "noload",
    "ext2": "",
}
"""File systems that drives may have, and their options. No other type is ever guessed."""

_libc = ctypes.CDLL(None, use_errno=True)


def mount(node: Path, target: Path, filesystem: str) -> None:
    """Mount a block device; the target folder is made. May hang as long as the device does.

    Raises `PayloadRefused` (FS_UNSUPPORTED, FS_ERROR) and `DriveGone` (DRIVE_GONE).
    """
    options = FILESYSTEMS.get(filesystem)
    if options is None:
        raise PayloadRefused(
            Problem(
                "FS_UNSUPPORTED",
                "the drive's file system is not read",
                where=str(node),
                need=" or ".join(sorted(FILESYSTEMS)),
                have=filesystem or "none",
                fix="format the drive as exFAT, FAT32 or ext4",
            )
        )
    target.mkdir(parents=True, exist_ok=True)
    if _call_mount(node, target, filesystem, options) == 0:
        return
    error = OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()), str(node))
    target.rmdir()
    if not node.exists():
        raise DriveGone(Problem("DRIVE_GONE", "went away while it was mounted", where=str(node)))
    raise PayloadRefused(
        Problem(
            "FS_ERROR",
            f"cannot be mounted as {filesystem} ({error.strerror})",
            where=str(node),
            fix="check the drive on another computer",
        )
    ) from error


def unmount(target: Path) -> None:
    """Detach what is mounted there, at once, and remove the mount point; nothing there is fine."""
    _libc.umount2(os.fsencode(target), MNT_DETACH | UMOUNT_NOFOLLOW)
    if target.is_dir() and not target.is_mount():
        target.rmdir()


def unmount_all(folder: Path) -> None:
    """Detach all that is mounted below a folder, and remove the mount points."""
    for target in mounted_below(folder):
        unmount(target)
    if folder.is_dir():
        for left in folder.iterdir():
            left.rmdir()


def mounted_below(folder: Path) -> list[Path]:
    """Mount points below a folder, innermost first, as /proc/self/mountinfo tells them."""
    base = folder.resolve()
    lines = Path("/proc/self/mountinfo").read_text(encoding="utf-8").splitlines()
    points = [Path(_unescaped(line.split()[4])) for line in lines]
    return sorted((p for p in points if base in p.parents), reverse=True)


def _call_mount(node: Path, target: Path, filesystem: str, options: str) -> int:
    result: int = _libc.mount(
        os.fsencode(node),
        os.fsencode(target),
        filesystem.encode(),
        ctypes.c_ulong(FLAGS),
        options.encode(),
    )
    return result


def _unescaped(field: str) -> str:
    """A field of mountinfo, where blanks and backslashes are octal.

    >>> _unescaped("/media/my\\\\040drive")
    '/media/my drive'
    """
    return re.sub(r"\\([0-7]{3})", lambda match: chr(int(match[1], 8)), field)

"""Mount and unmount of drives, by mount(2) itself; needs root.

Read-only, without set-uid, devices, execution or symlinks; a dirty ext4 journal is not replayed,
and the device itself takes no writes any more. What becomes of a file system that turns out damaged
is not left to its own word: that of ext4 can be that the kernel is to panic (ext4(5), errors=).
"""

from __future__ import annotations

import ctypes
import errno
import os
from collections.abc import Iterable, Mapping
from pathlib import Path

from nondum.host.sandbox.helper import drive_nodes, filesystems
from nondum.host.sandbox.helper.mountinfo import mounted_below
from nondum.sdk.errors import DriveGone, NondumError, PayloadRefused, Problem

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
    "ext4": "noload,errors=remount-ro",
    "ext3": "noload,errors=remount-ro",
    "ext2": "errors=remount-ro",
}
"""File systems that drives may have, and their options. No other type is ever guessed."""

_libc = ctypes.CDLL(None, use_errno=True)


def mount(node: Path, target: Path, filesystem: str, *, drive: str = "") -> None:
    """Mount a block device; the target folder is made. May hang as long as the device does.

    Without a `filesystem`, the device says which it has. Given a `drive`, no other one is mounted
    that has come to the same node since. Nothing can be written to the device afterwards. Raises
    `PayloadRefused` (FS_UNSUPPORTED, FS_ERROR, DRIVE_MOUNTED) and `DriveGone` (DRIVE_GONE).
    """
    with drive_nodes.held(node, drive, ours=target.parent) as source:
        filesystem = filesystem or _probed(source, node)
        if filesystem not in FILESYSTEMS:
            have = filesystem or "none that is known"
            raise unsupported(node, "the drive's file system is not read", have)
        target.mkdir(parents=True, exist_ok=True)
        error = _call_mount(source, target, filesystem, FILESYSTEMS[filesystem])
        if error == 0:
            return
        target.rmdir()
        if error == errno.ENODEV and not _is_known_to_kernel(filesystem):
            text = "this host's kernel does not read its file system"
            raise unsupported(node, text, filesystem, filter(_is_known_to_kernel, FILESYSTEMS))
        raise _unmountable(node, filesystem, error)


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


def _probed(source: Path, node: Path) -> str:
    try:
        return filesystems.probe(source)
    except OSError as error:
        text = f"cannot be read ({error.strerror})"
        fix = "pull it and plug it in again"
        raise DriveGone(Problem("DRIVE_GONE", text, where=str(node), fix=fix)) from error


def _call_mount(source: Path, target: Path, filesystem: str, options: str) -> int:
    """The error number; 0: it is mounted."""
    result: int = _libc.mount(
        os.fsencode(source),
        os.fsencode(target),
        filesystem.encode(),
        ctypes.c_ulong(FLAGS),
        options.encode(),
    )
    return ctypes.get_errno() if result else 0


def _is_known_to_kernel(filesystem: str) -> bool:
    return f"\t{filesystem}\n" in Path("/proc/filesystems").read_text(encoding="ascii")


def unsupported(
    node: Path, text: str, have: str, known: Iterable[str] = FILESYSTEMS
) -> PayloadRefused:
    """What to raise of a device with no file system that drives may have (FS_UNSUPPORTED)."""
    need = " or ".join(sorted(known))
    fix = "format the drive as one of them"
    return PayloadRefused(Problem("FS_UNSUPPORTED", text, str(node), need, have, fix))


def _unmountable(node: Path, filesystem: str, error: int) -> NondumError:
    if not node.exists():
        text = "went away while it was mounted"
        return DriveGone(Problem("DRIVE_GONE", text, where=str(node), fix="plug it in again"))
    if error == errno.EBUSY:
        return PayloadRefused(drive_nodes.mounted_elsewhere(node, os.strerror(error)))
    text = f"cannot be mounted as {filesystem} ({os.strerror(error)})"
    fix = "check the drive on another computer"
    return PayloadRefused(Problem("FS_ERROR", text, where=str(node), fix=fix))

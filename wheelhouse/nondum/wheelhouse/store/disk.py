"""This host's own disk: what is safe on it when the power fails, and what is told when it fails.

A file is safe once its bytes, and then the folder that names it, were synced, in this order
(fsync(2), rename(2)).
"""

from __future__ import annotations

import ctypes
import errno
import os
import shutil
from pathlib import Path

from nondum.sdk.errors import InstallFailed, Problem

_FULL = frozenset({errno.ENOSPC, errno.EDQUOT})
_FAILING = frozenset({errno.EIO, errno.EROFS, errno.EUCLEAN})
_MB = 1024 * 1024
_SHORT = {errno.EMFILE: "descriptors", errno.ENFILE: "descriptors", errno.ENOMEM: "memory"}

_AT_FDCWD, _RENAME_EXCHANGE = -100, 2
_libc = ctypes.CDLL(None, use_errno=True)


def make_folder(folder: Path) -> None:
    """Make a folder, and those above it, so that it is there after a power failure, too."""
    if folder.is_dir():
        return
    make_folder(folder.parent)
    folder.mkdir(exist_ok=True)
    sync(folder.parent)


def write(path: Path, data: bytes) -> None:
    """Give a file a content: whatever happens, it has the old one or the new one."""
    unfinished = path.with_name(f".{path.name}.part")
    with unfinished.open("wb") as out:
        out.write(data)
        out.flush()
        os.fsync(out.fileno())
    unfinished.rename(path)
    sync(path.parent)


def exchange(one: Path, other: Path) -> bool:
    """Have two paths change places at one stroke (renameat2(2)). Says whether they have: not every
    file system can, nor every system."""
    call = getattr(_libc, "renameat2", None)
    if call is None:
        return False
    paths = (_AT_FDCWD, os.fsencode(one), _AT_FDCWD, os.fsencode(other))
    return bool(call(*paths, _RENAME_EXCHANGE) == 0)


def sync(path: Path) -> None:
    """Have a file's bytes, or a folder's entries, on disk."""
    descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def sync_files(folder: Path) -> None:
    """Have the files in a folder on disk, and the folder."""
    for path in (*(path for path in folder.iterdir() if path.is_file()), folder):
        sync(path)


def sync_file_system(folder: Path) -> None:
    """syncfs(2): one call for all files just written, cheaper than an fsync for each."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        if _libc.syncfs(descriptor) != 0:
            code = ctypes.get_errno()
            raise OSError(code, os.strerror(code))
    finally:
        os.close(descriptor)


def free_mb(folder: Path, reserve_mb: int) -> int:
    """What is free on the file system that a folder is on, or will be, less a reserve."""
    there = next(found for found in (folder, *folder.parents) if found.exists())
    return max(0, shutil.disk_usage(there).free // _MB - reserve_mb)


def failed(error: OSError, what: str, where: Path) -> InstallFailed:
    """What is told when `what` could not be done at `where`."""
    return InstallFailed(problem_of(error, what, where))


def problem_of(error: OSError, what: str, where: Path) -> Problem:
    """DISK_FULL, IO_ERROR or NO_RESOURCES, as an error of the system says."""
    if error.errno in _FULL:
        return _full(what, where)
    if error.errno in _SHORT:
        short = _SHORT[error.errno]
        fix = f"find out what uses up this host's {short}; then plug it in again"
        return Problem("NO_RESOURCES", f"{what}: no {short} left", where=str(where), fix=fix)
    reason = error.strerror or str(error)
    fix = "see what is wrong with this host's disk; the kernel's log may tell"
    if error.errno not in _FAILING:
        fix = "try again; if it stays so, see the daemon's log"
    return Problem("IO_ERROR", f"{what}: {reason}", where=str(where), fix=fix)


def is_shortage(error: OSError) -> bool:
    """Whether this process or host has no descriptor or no memory left."""
    return error.errno in _SHORT


def is_short_of_memory(error: Exception) -> bool:
    """Whether Python had no memory; for a thread that there is none for it has no error class."""
    return isinstance(error, MemoryError) or "can't start new thread" in str(error)


def _full(what: str, where: Path) -> Problem:
    have, is_out_of_files = _free_space(where)
    return Problem(
        "DISK_FULL",
        f"{what}: {'the disk has no free inodes' if is_out_of_files else 'the disk is full'}",
        where=str(where),
        need="a free inode for each file" if is_out_of_files else "enough free space",
        have=have,
        fix="pull a payload, free some disk, or lower `quota_mb` under [install]",
    )


def _free_space(where: Path) -> tuple[str, bool]:
    """Free inodes or megabytes, in words, and whether the inodes are what is used up."""
    there = next((path for path in (where, *where.parents) if path.exists()), Path("/"))
    try:
        free = os.statvfs(there)
    except OSError:
        return "unknown", False
    # Some file systems have no fixed number of inodes, and say zero of zero.
    if free.f_files and not free.f_favail:
        return f"none free of {free.f_files} inodes", True
    return f"{free.f_bavail * free.f_frsize // 1024**2} MB free", False

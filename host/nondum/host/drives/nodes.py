"""Block device nodes: which insertion a node stands for now, and that nothing is written to it.

A name like /dev/sdb1 belongs to whatever is plugged in at the moment; the kernel counts insertions
(BLKGETDISKSEQ, since 5.15), and a device that is held open keeps its number.
"""

from __future__ import annotations

import errno
import fcntl
import os
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from nondum.sdk.errors import DriveGone, Problem

_BLKROSET = 0x125D
_BLKGETDISKSEQ = 0x80081280
_OLD_KERNEL = frozenset({errno.ENOTTY, errno.EINVAL})


def drive_name(device: str, diskseq: int | None) -> str:
    """What an insertion is called: kernel name and number.

    >>> drive_name("sdb1", 42), drive_name("sdb1", None)
    ('sdb1-42', 'sdb1')
    """
    return device if diskseq is None else f"{device}-{diskseq}"


@contextmanager
def held(node: Path, drive: str = "") -> Iterator[Path]:
    """A path by which the node of that drive can be mounted, read-only from now on until it is
    plugged in anew, and sure to be no other drive's while the context lasts.

    `drive` is as `drive_name` gives it; empty: whichever it is. Raises `DriveGone` (DRIVE_GONE)
    when it is another one by now.
    """
    try:
        descriptor = os.open(node, os.O_RDONLY | os.O_CLOEXEC)
    except OSError as error:
        raise _gone(node, f"went away before it was read ({error.strerror})") from error
    try:
        is_any = drive in ("", node.name)
        if not is_any and drive_name(node.name, diskseq(descriptor)) != drive:
            raise _gone(node, "was pulled, and another one is in its place")
        fcntl.ioctl(descriptor, _BLKROSET, struct.pack("i", 1))
        yield Path(f"/proc/self/fd/{descriptor}")
    finally:
        os.close(descriptor)


def diskseq(descriptor: int) -> int | None:
    """The number of the insertion that an open device stands for; None: the kernel counts none."""
    answer = bytearray(8)
    try:
        fcntl.ioctl(descriptor, _BLKGETDISKSEQ, answer)
    except OSError as error:
        if error.errno in _OLD_KERNEL:
            return None
        raise
    number: int = struct.unpack("Q", answer)[0]
    return number


def _gone(node: Path, text: str) -> DriveGone:
    return DriveGone(Problem("DRIVE_GONE", text, where=str(node), fix="plug it in again"))

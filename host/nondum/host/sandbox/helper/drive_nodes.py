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

from nondum.host.sandbox.helper.block_devices import Machine
from nondum.sdk.errors import DriveGone, PayloadRefused, Problem

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
def held(node: Path, drive: str = "", ours: Path | None = None) -> Iterator[Path]:
    """A path by which the node of that drive can be mounted, read-only from now on until it is
    plugged in again, and sure to be no other drive's while the context lasts.

    `drive` is as `drive_name` gives it; empty: whichever it is. Raises `DriveGone` (DRIVE_GONE)
    when it is another one by now, `PayloadRefused` (DRIVE_MOUNTED) when somebody else has it: it is
    mounted anywhere but below `ours`, or is a part of another device.
    """
    try:
        descriptor = os.open(node, os.O_RDONLY | os.O_CLOEXEC)
    except OSError as error:
        raise _gone(node, f"went away before it was read ({error.strerror})") from error
    try:
        is_any = drive in ("", node.name)
        if not is_any and drive_name(node.name, diskseq(descriptor)) != drive:
            raise _gone(node, "was pulled, and another one is in its place")
        path = Path(f"/proc/self/fd/{descriptor}")
        with _claimed(path, node, ours):
            fcntl.ioctl(descriptor, _BLKROSET, struct.pack("i", 1))
        yield path
    finally:
        os.close(descriptor)


@contextmanager
def _claimed(path: Path, node: Path, ours: Path | None) -> Iterator[None]:
    """Claim a device that is not in use, as long as the context lasts. Raises `PayloadRefused`
    (DRIVE_MOUNTED).

    O_EXCL claims it as mounts and swaps do (open(2)): the answer to a mere question whether it is
    in use could be out of date. What this host has mounted itself, or has just let go, is
    claimed already; and what has gone meanwhile can no longer be mounted.
    """
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_EXCL)
    except OSError as error:
        use = Machine().uses(ours or Path("/nowhere")).get(node.resolve().name)
        if use is not None:
            raise PayloadRefused(mounted_elsewhere(node, use.why)) from error
        yield
        return
    try:
        yield
    finally:
        os.close(descriptor)


def mounted_elsewhere(node: Path, why: str) -> Problem:
    """What is told of a drive that somebody else has mounted, or uses otherwise."""
    return Problem(
        "DRIVE_MOUNTED",
        f"somebody else uses it, so it is not read: {why}",
        where=str(node),
        fix="unmount it there, pull it and plug it in again; do not have drives mounted by others",
    )


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

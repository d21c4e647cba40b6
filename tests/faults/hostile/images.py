"""Block devices whose file systems are none, foreign or damaged."""

from __future__ import annotations

import random
import subprocess
from collections.abc import Callable
from pathlib import Path

from tests.faults.hostile.case import NO_PAYLOAD, Bench, HostileDrive

UNSUPPORTED, ERROR = "FS_UNSUPPORTED", "FS_ERROR"
SIZE = 8 * 2**20
SUPERBLOCK = 1024

Change = Callable[[bytearray], None]


def image_of(bench: Bench) -> Path:
    """Where the device's bytes belong."""
    return bench.drive.with_suffix(".img")


def raw(name: str, code: str, fill: Callable[[], bytes]) -> HostileDrive:
    def make(bench: Bench) -> None:
        image_of(bench).write_bytes(fill().ljust(SIZE, b"\0"))

    return HostileDrive(name, code, make, is_image=True)


def at(offset: int, magic: bytes) -> Callable[[], bytes]:
    return lambda: bytes(offset) + magic


def ext4(name: str, code: str, change: Change, *, payload: bool = False) -> HostileDrive:
    """An ext4 that something was done to."""

    def make(bench: Bench) -> None:
        if payload:
            bench.sound()
        image = image_of(bench)
        image.write_bytes(bytes(SIZE))
        command = ["mkfs.ext4", "-q", "-F", "-d", str(bench.drive), str(image)]
        subprocess.run(command, check=True, capture_output=True)
        data = bytearray(image.read_bytes())
        change(data)
        image.write_bytes(data)

    return HostileDrive(name, code, make, is_image=True)


def patch(offset: int, data: bytes) -> Change:
    def change(image: bytearray) -> None:
        image[offset : offset + len(data)] = data

    return change


def cut(to: int) -> Change:
    def change(image: bytearray) -> None:
        del image[to:]

    return change


def noise() -> bytes:
    return random.Random(3).randbytes(SIZE)


def nothing(image: bytearray) -> None: ...


DRIVES: tuple[HostileDrive, ...] = (
    raw("device-of-zeros", UNSUPPORTED, bytes),
    raw("device-of-noise", UNSUPPORTED, noise),
    raw("device-ntfs", UNSUPPORTED, at(3, b"NTFS    ")),
    raw("device-btrfs", UNSUPPORTED, at(65600, b"_BHRfS_M")),
    raw("device-xfs", UNSUPPORTED, at(0, b"XFSB")),
    raw("device-squashfs", UNSUPPORTED, at(0, b"hsqs")),
    raw("device-iso", UNSUPPORTED, at(32769, b"CD001")),
    raw("device-encrypted", UNSUPPORTED, at(0, b"LUKS\xba\xbe")),
    raw("device-swap", UNSUPPORTED, at(4086, b"SWAPSPACE2")),
    raw("device-raid", UNSUPPORTED, at(4096, b"\xfc\x4e\x2b\xa9")),
    raw("device-that-says-ext4", ERROR, at(1080, b"\x53\xef")),
    ext4("ext4-without-inodes", ERROR, patch(SUPERBLOCK, bytes(4))),
    ext4("ext4-of-giant-blocks", ERROR, patch(SUPERBLOCK + 24, b"\xff\xff\xff\xff")),
    ext4("ext4-of-features-of-tomorrow", ERROR, patch(SUPERBLOCK + 96, b"\xff\xff\xff\xff")),
    ext4("ext4-without-groups", ERROR, patch(2048, bytes(1024))),
    ext4("ext4-cut", ERROR, cut(64 * 1024)),
    ext4("ext4-empty", NO_PAYLOAD, nothing),
    ext4("ext4-sound", "", nothing, payload=True),
)

"""Block devices whose file systems are none, foreign, damaged or odd."""

from __future__ import annotations

import os
import random
import struct
import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path

from tests.faults.hostile.case import NO_PAYLOAD, Bench, HostileDrive

UNSUPPORTED, ERROR = "FS_UNSUPPORTED", "FS_ERROR"
SIZE = 8 * 2**20
TWINS = "6b1d2a52-3f0e-4c55-9d3c-7a2f10c0ffee"
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


def ext4(name: str, code: str, change: Change) -> HostileDrive:
    """An ext4 that something was done to."""

    def make(bench: Bench) -> None:
        formatted(bench)
        image = image_of(bench)
        data = bytearray(image.read_bytes())
        change(data)
        image.write_bytes(data)

    return HostileDrive(name, code, make, is_image=True)


def sound(
    name: str,
    *options: str,
    code: str = "",
    tampers: Sequence[str] = (),
    beside: Callable[[Bench], None] = lambda bench: None,
) -> HostileDrive:
    """An ext4 with a payload that works, made with options of mkfs.ext4; then debugfs(8) is told to
    do something, where FOLDER and DRIVE stand for the payload's folder and that above it."""

    def make(bench: Bench) -> None:
        bench.sound()
        beside(bench)
        formatted(bench, *options)
        for tamper in tampers:
            words = tamper.replace("FOLDER", f"/nondum/{bench.payload_id}")
            run("debugfs", "-w", "-R", words, str(image_of(bench)))

    return HostileDrive(name, code, make, is_image=True)


def formatted(bench: Bench, *options: str) -> None:
    """The device has a file system with what lies in the drive's folder."""
    image_of(bench).write_bytes(bytes(SIZE))
    run("mkfs.ext4", "-q", "-F", *options, "-d", str(bench.drive), str(image_of(bench)))


def run(*command: str) -> None:
    subprocess.run(command, check=True, capture_output=True)


def is_known(feature: str) -> bool:
    """Whether this machine's ext4 has a feature."""
    return (Path("/sys/fs/ext4/features") / feature).exists()


def of_a_kernel(filesystem: str, code: str) -> str:
    """What a drive with a file system is told with, that only some kernels know."""
    found = Path("/proc/filesystems").read_text(encoding="ascii")
    return code if f"\t{filesystem}\n" in found else UNSUPPORTED


def fats_that_differ(bench: Bench) -> None:
    """The second of a FAT's two tables is another than the first."""
    image_of(bench).write_bytes(bytes(SIZE))
    run("mkfs.vfat", "-F", "12", "-n", "LAMP", str(image_of(bench)))
    data = bytearray(image_of(bench).read_bytes())
    reserved, tables, length = struct.unpack_from("<H", data, 14)[0], data[16], data[22:24]
    at = 512 * (reserved + int.from_bytes(length, "little"))
    assert tables == 2
    data[at + 4 : at + 400] = b"\xf7" * 396
    image_of(bench).write_bytes(data)


def partitions(*entries: tuple[int, int]) -> Callable[[], bytes]:
    """A PC's first sector with a table of partitions: for each, its first sector and its size."""

    def fill() -> bytes:
        rows = [struct.pack("<B3sB3sII", 0, bytes(3), 0x83, bytes(3), *entry) for entry in entries]
        return bytes(446) + b"".join(rows).ljust(64, b"\0") + b"\x55\xaa"

    return fill


def a_device_within(bench: Bench) -> None:
    """The payload lies in an image that lies on the drive, which is not looked into."""
    bench.sound()
    inner = bench.drive.with_suffix(".inner")
    inner.write_bytes(bytes(SIZE // 2))
    run("mkfs.ext4", "-q", "-F", "-d", str(bench.drive), str(inner))
    (bench.drive / "nondum").rename(bench.drive.with_suffix(".away"))
    (bench.drive / "nondum.img").write_bytes(inner.read_bytes())
    formatted(bench)
    inner.unlink()


def long_names(bench: Bench) -> None:
    """Names and depths as an ext4 can have them, beside the payload and in its folder."""
    for folder in (bench.drive, bench.drive / "nondum", bench.folder):
        (folder / ("n" * 255)).touch()
        (folder / "/".join("d" * 100)).mkdir(parents=True)


def folders(bench: Bench) -> None:
    """What may lie beside payloads, and is empty."""
    for name in ("nondum-peers", "nondum-trust"):
        (bench.drive / name).mkdir()


def attributes(bench: Bench) -> None:
    """As much as a file can have beside its bytes."""
    for path in (bench.folder, bench.folder / "CONTENTS"):
        os.setxattr(path, "user.big", b"x" * 500)


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


CASEFOLD = "" if is_known("casefold") else ERROR

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
    sound("ext4-sound"),
    sound("ext4-that-wants-a-panic", "-e", "panic"),
    sound("ext4-of-large-blocks", "-b", "4096"),
    sound("ext4-without-journal", "-O", "^has_journal"),
    sound("ext4-whose-label-clears-screens", "-L", "\x1b[2J\x1b]0;a\x07"),
    sound("ext4-one-of-twins", "-U", TWINS),
    sound("ext4-other-of-twins", "-U", TWINS),
    sound("ext4-of-folders-without-case", "-O", "casefold", code=CASEFOLD),
    sound("ext4-that-is-mounted-elsewhere", "-O", "mmp"),
    sound("ext4-with-files-in-inodes", "-O", "inline_data"),
    sound("ext4-with-long-names", beside=long_names),
    sound("ext4-with-attributes", beside=attributes),
    sound("ext4-of-an-unclean-end", tampers=["feature needs_recovery"]),
    sound("ext4-that-is-full-of-errors", tampers=["ssv state 2", "ssv error_count 9999"]),
    sound("ext4-larger-than-its-device", code=ERROR, tampers=["ssv blocks_count 9999999"]),
    sound("ext4-of-a-broken-root", code=ERROR, tampers=["sif / mode 0100644"]),
    sound("ext4-of-a-broken-folder", code=ERROR, tampers=["sif /nondum block[5] 9999999"]),
    sound(
        "ext4-of-a-broken-list", code=ERROR, tampers=["sif FOLDER/CONTENTS size 0x7fffffffffffff"]
    ),
    sound(
        "ext4-of-a-file-in-no-place", code=ERROR, tampers=["sif FOLDER/index.json block[5] 9999999"]
    ),
    sound(
        "ext4-of-a-file-that-is-encrypted",
        code=ERROR,
        tampers=["sif FOLDER/CONTENTS flags 0x80800"],
    ),
    sound("ext4-of-a-file-with-a-seal", code=ERROR, tampers=["sif FOLDER/CONTENTS flags 0x180000"]),
    sound("ext4-of-a-folder-without-case", code=ERROR, tampers=["sif FOLDER flags 0x40080000"]),
    sound("ext4-whose-folder-is-the-root", code=ERROR, tampers=["unlink /nondum", "ln / /nondum"]),
    sound(
        "ext4-whose-list-is-the-journal",
        code=ERROR,
        tampers=["unlink FOLDER/CONTENTS", "ln <8> FOLDER/CONTENTS"],
    ),
    sound(
        "ext4-of-torn-certificates", beside=folders, tampers=["sif /nondum-peers flags 0x40080000"]
    ),
    sound(
        "ext4-of-a-torn-trust-folder",
        beside=folders,
        tampers=["sif /nondum-trust flags 0x40080000"],
    ),
    HostileDrive("device-within-a-drive", NO_PAYLOAD, a_device_within, is_image=True),
    HostileDrive(
        "fat-whose-tables-differ", of_a_kernel("vfat", NO_PAYLOAD), fats_that_differ, is_image=True
    ),
    raw("table-of-one-partition-twice", UNSUPPORTED, partitions((2048, 2048), (2048, 2048))),
    raw("table-of-partitions-that-overlap", UNSUPPORTED, partitions((2048, 4096), (4096, 4096))),
    raw("table-that-leads-beyond", UNSUPPORTED, partitions((2048, 2**32 - 4096), (2**31, 9))),
    raw("table-that-lists-itself", UNSUPPORTED, partitions((0, 16384), (0, 1))),
)

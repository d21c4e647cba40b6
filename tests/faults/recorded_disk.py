"""A disk that remembers each write and flush in their order, so that the power can be cut anywhere.

A file system of one file (FUSE, Documentation/filesystems/fuse.rst) stands behind a loop device.
Its log holds, for each write, `offset, size, data`, and `0, 0` for each flush. What a drive had in
its cache when the power failed is any part of the writes since the last flush.

Run as a program, this module is the file system: `LOG SIZE TARGET`.
"""

from __future__ import annotations

import ctypes
import errno
import os
import random
import stat
import struct
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parent.parent.parent
NAME = "disk"

_RECORD = struct.Struct("<QI")
_IN = struct.Struct("<IIQQIIIHH")
_OUT = struct.Struct("<IiQ")
_libc = ctypes.CDLL(None, use_errno=True)


@dataclass(frozen=True)
class Write:
    """One write; no data: a flush."""

    offset: int
    data: bytes
    end: int
    """How long the log was after it."""


def writes(log: Path) -> Iterator[Write]:
    """Everything that the disk was told, in order."""
    data = log.read_bytes()
    at = 0
    while at < len(data):
        offset, size = _RECORD.unpack_from(data, at)
        at += _RECORD.size + size
        yield Write(offset, data[at - size : at], at)


def cut(image: Path, done: list[Write], chance: random.Random | None = None) -> None:
    """Bring an image, as it was at first, to where the power failed after the writes `done`.

    With a `chance`, what came after the last flush is there or not, each write by itself.
    """
    flushed = _flushed(done)
    with image.open("r+b") as disk:
        for i, write in enumerate(done):
            if i < flushed or chance is None or chance.random() < 0.5:
                disk.seek(write.offset)
                disk.write(write.data)


def drop(image: Path, done: list[Write]) -> None:
    """The same, with nothing there of what came after the last flush."""
    cut(image, done[: _flushed(done)])


def _flushed(done: list[Write]) -> int:
    return max((i for i, write in enumerate(done) if not write.data), default=0)


@contextmanager
def recorded(folder: Path, size_mb: int, mount: Path) -> Iterator[Path]:
    """An ext4 file system at `mount` on such a disk; gives its log. Needs root.

    The image as it was at first is `first` in the folder.
    """
    log, target = folder / "log", folder / "fuse"
    target.mkdir(parents=True)
    log.touch()
    arguments = [str(log), str(size_mb * 1024**2), str(target)]
    server = subprocess.Popen(
        [sys.executable, "-m", "tests.faults.recorded_disk", *arguments],
        stdout=subprocess.PIPE,
        cwd=ROOT,
    )
    assert server.stdout is not None
    server.stdout.readline()
    try:
        make = ["mkfs.ext4", "-q", "-F", "-E", "lazy_itable_init=0,lazy_journal_init=0"]
        subprocess.run([*make, str(target / NAME)], check=True)
        (folder / "first").write_bytes((target / NAME).read_bytes())
        log.write_bytes(b"")
        mount.mkdir(parents=True, exist_ok=True)
        subprocess.run(["mount", "-o", "loop", str(target / NAME), str(mount)], check=True)
        try:
            yield log
        finally:
            subprocess.run(["umount", "--lazy", str(mount)], check=True)
    finally:
        subprocess.run(["umount", "--lazy", str(target)], check=False)
        server.kill()
        server.wait()
        server.stdout.close()


class _File:
    """The file system's end of /dev/fuse. The file is kept in memory."""

    def __init__(self, log: int, size: int) -> None:
        self._log = log
        self._data = bytearray(size)

    def serve(self, fuse: int) -> None:
        """Answer until it is unmounted."""
        while True:
            try:
                request = os.read(fuse, 2 * 1024**2)
            except OSError as error:
                if error.errno == errno.ENODEV:
                    return
                if error.errno in (errno.ENOENT, errno.EINTR, errno.EAGAIN):
                    continue
                raise
            _, opcode, unique, node, *_ = _IN.unpack_from(request)
            answer = self._answer(opcode, node, memoryview(request)[_IN.size :])
            if answer is None:
                continue
            code, data = (answer, b"") if isinstance(answer, int) else (0, answer)
            os.write(fuse, _OUT.pack(_OUT.size + len(data), -code, unique) + data)

    def _answer(self, opcode: int, node: int, body: memoryview) -> bytes | int | None:
        match opcode:
            case 26:  # INIT
                return struct.pack("<IIIIHHIIHHI28x", 7, 31, 0, 1 << 5, 64, 48, 131072, 1, 0, 0, 0)
            case 1:  # LOOKUP
                if bytes(body).rstrip(b"\0") != NAME.encode():
                    return errno.ENOENT
                return struct.pack("<QQQQII", 2, 0, 3600, 3600, 0, 0) + self._attributes(2)
            case 3 | 4:  # GETATTR, SETATTR
                return struct.pack("<QII", 3600, 0, 0) + self._attributes(node)
            case 14 | 27:  # OPEN, OPENDIR
                return struct.pack("<QII", 0, 2, 0)
            case 15:  # READ
                _, offset, size = struct.unpack_from("<QQI", body)
                return bytes(self._data[offset : offset + size])
            case 16:  # WRITE
                _, offset, size = struct.unpack_from("<QQI", body)
                self._write(offset, bytes(body[40 : 40 + size]))
                return struct.pack("<II", size, 0)
            case 20:  # FSYNC
                os.write(self._log, _RECORD.pack(0, 0))
                return b""
            case 18 | 25 | 29:  # RELEASE, FLUSH, RELEASEDIR
                return b""
            case 2 | 42:  # FORGET, BATCH_FORGET
                return None
            case _:
                return errno.ENOSYS

    def _write(self, offset: int, data: bytes) -> None:
        self._data[offset : offset + len(data)] = data
        os.write(self._log, _RECORD.pack(offset, len(data)) + data)

    def _attributes(self, node: int) -> bytes:
        size = len(self._data) if node == 2 else 0
        mode = stat.S_IFREG | 0o600 if node == 2 else stat.S_IFDIR | 0o700
        numbers = (node, size, size // 512, 0, 0, 0, 0, 0, 0, mode, 1, 0, 0, 0, 4096, 0)
        return struct.pack("<6Q10I", *numbers)


def main(log: str, size: str, target: str) -> None:
    fuse = os.open("/dev/fuse", os.O_RDWR | os.O_CLOEXEC)
    options = f"fd={fuse},rootmode=40000,user_id=0,group_id=0"
    if _libc.mount(b"recorded", target.encode(), b"fuse", 0, options.encode()) != 0:
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
    print("mounted", flush=True)  # noqa: T201  # that is waited for
    _File(os.open(log, os.O_WRONLY | os.O_APPEND), int(size)).serve(fuse)


if __name__ == "__main__":
    main(*sys.argv[1:])

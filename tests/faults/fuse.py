"""A drive whose device answers as a test likes: other bytes each time, none at all, or for ever.

A small server of the kernel's FUSE protocol (linux/fuse.h, version 7.31) over /dev/fuse, in a
separate thread. It serves a folder, read-only; one file in it may be given other answers.
"""

from __future__ import annotations

import ctypes
import errno
import os
import stat
import struct
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

Answer = Callable[[int, int, int], bytes]
"""Bytes for (opening, offset, length): the first time that a file is opened is 0. May block, and
raise `OSError`."""

_IN = struct.Struct("<IIQQIIIHH")
_OUT = struct.Struct("<IiQ")
_ATTR = struct.Struct("<QQQQQQIIIIIIIIII")
_READ = struct.Struct("<QQIIQII")
LOOKUP, FORGET, GETATTR, READLINK, OPEN, READ, STATFS = 1, 2, 3, 5, 14, 15, 17
RELEASE, GETXATTR, FLUSH, INIT, OPENDIR, READDIR, RELEASEDIR = 18, 22, 25, 26, 27, 28, 29
INTERRUPT, BATCH_FORGET = 36, 42
_SILENT = frozenset({FORGET, INTERRUPT, BATCH_FORGET})
_DONE = frozenset({RELEASE, FLUSH, RELEASEDIR})
_DIRECT_IO = 1
_MOST = 128 * 1024
_FLAGS = 0x1 | 0x2 | 0x4 | 0x8
"""Read-only, and without set-uid, devices and execution."""

_FORCE, _DETACH = 1, 2
"""Of umount2(2). The first ends the connection even while a process waits for an answer."""
_END_S = 60.0

_libc = ctypes.CDLL(None, use_errno=True)


@dataclass
class FuseDrive:
    """A served folder. Made by `served`."""

    root: Path
    """What is served."""
    mount: Path
    """Where it can be read."""
    answers: dict[str, Answer] = field(default_factory=dict)
    """Path → what its readers get."""
    endless: set[str] = field(default_factory=set)
    """Folders that have more and more names."""
    reads: dict[str, int] = field(default_factory=dict)
    """Path → how often it was opened."""
    listed: set[str] = field(default_factory=set)
    """Folders whose names were read."""
    asked: set[str] = field(default_factory=set)
    """Paths that were asked for by name, whether they are there or not."""
    _nodes: list[str] = field(default_factory=lambda: [""])
    _device: int = -1
    _writing: threading.Lock = field(default_factory=threading.Lock)

    def serve(self) -> None:
        """Answer until the drive is unmounted."""
        while True:
            try:
                request = os.read(self._device, _MOST + 4096)
            except OSError as error:
                if error.errno == errno.ENODEV:  # unmounted
                    return
                if error.errno in (errno.ENOENT, errno.EINTR):
                    continue
                raise
            # Each in its own thread: one that blocks holds up no other request.
            threading.Thread(target=self._answer, args=(request,), daemon=True).start()

    def _answer(self, request: bytes) -> None:
        _, opcode, unique, node, *_ = _IN.unpack_from(request)
        if opcode in _SILENT:
            return
        try:
            body, error = self._body(opcode, node, request[_IN.size :]), 0
        except OSError as failed:
            body, error = b"", failed.errno or errno.EIO
        with self._writing, suppress(OSError):  # who asked gave up meanwhile
            if self._device >= 0:
                os.write(self._device, _OUT.pack(_OUT.size + len(body), -error, unique) + body)

    def close(self) -> None:
        """Let go of the device: its number may be another file's from now on."""
        with self._writing:
            os.close(self._device)
            self._device = -1

    def _body(self, opcode: int, node: int, given: bytes) -> bytes:
        path = self._nodes[node - 1] if 0 < node <= len(self._nodes) else ""
        if opcode == INIT:
            return struct.pack("<IIIIHHIIHHI7I", 7, 31, 0, 0, 12, 9, _MOST, 1, 0, 0, 0, *([0] * 7))
        if opcode == LOOKUP:
            name = os.fsdecode(given.rstrip(b"\0"))
            return self._entry(f"{path}/{name}".lstrip("/"))
        if opcode == GETATTR:
            return struct.pack("<QII", 0, 0, 0) + self._attributes(path, node)
        if opcode == OPENDIR:
            self.listed.add(path)
            return struct.pack("<QIi", 0, 0, 0)
        if opcode == READDIR:
            return self._names(path, _READ.unpack_from(given)[1])
        if opcode == OPEN:
            handle = self.reads.get(path, 0)
            self.reads[path] = handle + 1
            return struct.pack("<QIi", handle, _DIRECT_IO, 0)
        if opcode == READ:
            handle, offset, size, *_ = _READ.unpack_from(given)
            return self.answers.get(path, self._plainly(path))(handle, offset, size)[:size]
        if opcode in _DONE:
            return b""
        if opcode == STATFS:
            return struct.pack("<QQQQQIIII6I", 0, 0, 0, 0, 0, 512, 255, 512, 0, *([0] * 6))
        raise OSError(errno.ENOSYS, "not served")

    def _plainly(self, path: str) -> Answer:
        data = (self.root / path).read_bytes()
        return lambda opening, offset, size: data[offset : offset + size]

    def _entry(self, path: str) -> bytes:
        self.asked.add(path)
        if not (self.root / path).exists():
            raise OSError(errno.ENOENT, path)
        if path not in self._nodes:
            self._nodes.append(path)
        node = self._nodes.index(path) + 1
        return struct.pack("<QQQQII", node, 0, 0, 0, 0, 0) + self._attributes(path, node)

    def _attributes(self, path: str, node: int) -> bytes:
        found = (self.root / path).stat()
        kind = (stat.S_IFDIR | 0o555) if stat.S_ISDIR(found.st_mode) else (stat.S_IFREG | 0o444)
        times = (0, 0, 0, 0, 0, 0)
        return _ATTR.pack(node, found.st_size, 8, *times, kind, 1, 0, 0, 0, 512, 0)

    def _names(self, path: str, offset: int) -> bytes:
        if path in self.endless:
            listed = [f"{number:08}" for number in range(offset + 100)]
        else:
            listed = sorted(p.name for p in (self.root / path).iterdir())
        packed = b""
        for number, name in list(enumerate(listed, start=1))[offset:]:
            raw = os.fsencode(name)
            entry = struct.pack("<QQII", number + 1, number, len(raw), 0) + raw
            packed += entry.ljust((len(entry) + 7) // 8 * 8, b"\0")
        return packed[:4096] if len(packed) <= 4096 else packed[:0]


@contextmanager
def served(root: Path, mount: Path) -> Iterator[FuseDrive]:
    """A folder, as a drive at `mount` that a test can make lie. Needs root and /dev/fuse."""
    mount.mkdir(parents=True, exist_ok=True)
    drive = FuseDrive(root, mount)
    drive._device = os.open("/dev/fuse", os.O_RDWR | os.O_CLOEXEC)
    options = f"fd={drive._device},rootmode=40000,user_id=0,group_id=0,allow_other".encode()
    target = os.fsencode(mount)
    if _libc.mount(b"fuse", target, b"fuse", ctypes.c_ulong(_FLAGS), options):
        os.close(drive._device)
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()), str(mount))
    serving = threading.Thread(target=drive.serve, daemon=True)
    serving.start()
    try:
        yield drive
    finally:
        _libc.umount2(target, _FORCE | _DETACH)
        serving.join(_END_S)
        assert not serving.is_alive(), "it would read whatever has its descriptor's number next"
        drive.close()

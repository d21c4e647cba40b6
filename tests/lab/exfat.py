"""exFAT images filled without being mounted: no tool of exfatprogs copies files into one.

Microsoft, "exFAT file system specification". What is written lies in one piece, so that the file
allocation table has nothing to say of it (NoFatChain), and names are ASCII.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

_ENTRY = 32
_BITMAP, _FILE, _STREAM, _NAME = 0x81, 0x85, 0xC0, 0xC1
_ALLOCATED, _NO_CHAIN = 0x01, 0x02
_DIRECTORY, _ARCHIVE = 0x10, 0x20
_NEW_YEAR_1980 = 1 << 21 | 1 << 16
_NAME_LETTERS = 15


def fill(image: Path, content: Path) -> None:
    """Write what is in a folder into an empty file system that mkfs.exfat has made.

    Raises `ValueError` when there is too little space.
    """
    data = bytearray(image.read_bytes())
    volume = _Volume.of(data)
    volume.write_root(b"".join(_entries(volume, content)))
    image.write_bytes(data)


@dataclass
class _Volume:
    """The bytes of an image, and how its clusters lie in them."""

    data: bytearray
    heap: int
    cluster: int
    """Bytes of one."""
    clusters: int
    root: int
    bitmap: int
    """Where the bitmap of used clusters begins."""
    next: int
    """The first cluster that is free, as all after it are."""

    @classmethod
    def of(cls, data: bytearray) -> _Volume:
        heap, clusters, root = struct.unpack_from("<III", data, 88)
        sector, per_cluster = 1 << data[108], 1 << data[109]
        volume = cls(data, heap * sector, sector * per_cluster, clusters, root, 0, 0)
        start = volume.place(root)
        entries = range(start, start + volume.cluster, _ENTRY)
        bitmap = next(at for at in entries if data[at] == _BITMAP)
        volume.bitmap = volume.place(struct.unpack_from("<I", data, bitmap + 20)[0])
        volume.next = 2 + max(n for n in range(clusters) if volume.is_used(n)) + 1
        return volume

    def place(self, cluster: int) -> int:
        """Where a cluster begins; the first has number 2."""
        return self.heap + (cluster - 2) * self.cluster

    def is_used(self, number: int) -> bool:
        return bool(self.data[self.bitmap + number // 8] >> number % 8 & 1)

    def store(self, content: bytes) -> int:
        """Write to clusters that are free; answers the first one's number."""
        first, count = self.next, -(-len(content) // self.cluster)
        if first + count > self.clusters + 2:
            raise ValueError(f"no space for {len(content)} bytes")
        self.next += count
        for number in range(first - 2, self.next - 2):
            self.data[self.bitmap + number // 8] |= 1 << number % 8
        start = self.place(first)
        self.data[start : start + len(content)] = content
        return first

    def write_root(self, entries: bytes) -> None:
        """Add to the root directory, which has one cluster."""
        start = self.place(self.root)
        used = next(at for at in range(start, start + self.cluster, _ENTRY) if not self.data[at])
        if used + len(entries) > start + self.cluster:
            raise ValueError("too many entries in the root directory")
        self.data[used : used + len(entries)] = entries


def _entries(volume: _Volume, folder: Path) -> Iterator[bytes]:
    """The directory entries of all that is in a folder, written below it first."""
    for path in sorted(folder.iterdir()):
        if path.is_dir():
            inner = b"".join(_entries(volume, path))
            size = max(1, -(-len(inner) // volume.cluster)) * volume.cluster
            yield _entry_set(path.name, _DIRECTORY, volume.store(inner.ljust(size, b"\0")), size)
        else:
            content = path.read_bytes()
            first = volume.store(content) if content else 0
            yield _entry_set(path.name, _ARCHIVE, first, len(content))


def _entry_set(name: str, attributes: int, first: int, size: int) -> bytes:
    letters = name.encode("utf-16-le")
    pieces = [letters[at : at + _NAME_LETTERS * 2] for at in range(0, len(letters), 30)]
    flags = _ALLOCATED | (_NO_CHAIN if size else 0)
    stream = struct.pack("<BBxBH2xQ4xIQ", _STREAM, flags, len(name), _hash(name), size, first, size)
    names = b"".join(struct.pack("<BB30s", _NAME, 0, piece) for piece in pieces)
    stamps = (_NEW_YEAR_1980,) * 3

    def head(checksum: int) -> bytes:
        return struct.pack("<BBHH2xIII12x", _FILE, 1 + len(pieces), checksum, attributes, *stamps)

    return head(_sum(head(0)[:2] + head(0)[4:] + stream + names)) + stream + names


def _hash(name: str) -> int:
    return _sum(name.upper().encode("utf-16-le"))


def _sum(data: bytes) -> int:
    """The checksum of the specification: rotated by one, and added to."""
    total = 0
    for byte in data:
        total = ((total << 15 | total >> 1) + byte) & 0xFFFF
    return total

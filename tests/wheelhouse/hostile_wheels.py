"""Wheels that are wrong in one way each, built byte by byte where zipfile would not write them.

ZipBuilder().add("a/__init__.py", b"").bytes()

The corpus that is made with these is `tests.wheelhouse.hostile`.
"""

from __future__ import annotations

import base64
import hashlib
import struct
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

NAME = "evil-1.0-py3-none-any.whl"
INFO = "evil-1.0.dist-info"
METADATA = b"Metadata-Version: 2.1\nName: evil\nVersion: 1.0\n"
WHEEL = b"Wheel-Version: 1.0\nGenerator: test\nRoot-Is-Purelib: true\nTag: py3-none-any\n"

_LOCAL = struct.Struct("<4s5H3L2H")
_CENTRAL = struct.Struct("<4s6H3L5H2L")
_END = struct.Struct("<4s4H2LH")
_END64 = struct.Struct("<4sQ2H2L4Q")
_LOCATOR = struct.Struct("<4sLQL")


@dataclass(frozen=True)
class Lie:
    """Where a member's headers say something other than the truth; None: the truth."""

    local_name: str | None = None
    local_size: int | None = None
    """Packed size in the member's own header."""
    local_crc: int | None = None
    local_flags: int | None = None
    local_method: int | None = None
    local_extra: bytes = b""
    size: int | None = None
    crc: int | None = None
    flags: int = 0
    method: int | None = None
    """0: the bytes are stored, not deflated; any other is only claimed."""
    mode: int = 0o100644
    attributes: int = 0
    """The low half of the external attributes, as DOS has them."""
    extra: bytes = b""
    comment: bytes = b""
    disk: int = 0
    raw_name: bytes | None = None
    """The name's bytes in both headers, where they are not the name in UTF-8."""
    after: bytes = b""
    """What follows the packed bytes: a data descriptor, or something hidden."""
    is_unlisted: bool = False
    """In the file, but not in its directory."""


@dataclass(frozen=True)
class ZipMember:
    """A member as it is to be written."""

    name: str
    data: bytes
    lie: Lie = Lie()

    @property
    def packed(self) -> bytes:
        """Its bytes as they stand in the file."""
        if self.lie.method == 0:
            return self.data
        packer = zlib.compressobj(9, zlib.DEFLATED, -zlib.MAX_WBITS)
        return packer.compress(self.data) + packer.flush()


@dataclass(frozen=True)
class End:
    """Where the end of the directory says something other than the truth; None: the truth."""

    count: int | None = None
    disk_count: int | None = None
    disk: int = 0
    directory_size: int | None = None
    directory_offset: int | None = None
    comment: bytes = b""
    with_zip64: bool = False
    zip64_count: int | None = None
    zip64_offset: int | None = None
    zip64_size: int = 44
    located_at: int | None = None
    between: bytes = b""
    """Bytes between the directory and what ends it."""


@dataclass(frozen=True)
class ZipBuilder:
    """A zip file under construction; every step returns a new one."""

    members: tuple[ZipMember, ...] = ()
    prefix: bytes = b""
    suffix: bytes = b""
    overlaid: bool = False
    """Every directory entry points at the first member's bytes."""
    end: End = End()

    def add(self, name: str, data: bytes, lie: Lie = Lie()) -> ZipBuilder:  # frozen
        """One more member, deflated."""
        return replace(self, members=(*self.members, ZipMember(name, data, lie)))

    def bytes(self) -> bytes:
        """The whole file."""
        body, directory, first = bytearray(self.prefix), bytearray(), len(self.prefix)
        listed = [m for m in self.members if not m.lie.is_unlisted]
        for member in self.members:
            offset = first if self.overlaid else len(body)
            local, central = _entry(member, offset)
            if not self.overlaid or member is self.members[0]:
                body += local
            if not member.lie.is_unlisted:
                directory += central
        return bytes(body + directory) + _ending(self.end, listed, body, directory) + self.suffix


def _ending(end: End, listed: Sequence[ZipMember], body: bytearray, directory: bytearray) -> bytes:
    count = len(listed) if end.count is None else end.count
    size = len(directory) if end.directory_size is None else end.directory_size
    offset = len(body) if end.directory_offset is None else end.directory_offset
    disk_count = count if end.disk_count is None else end.disk_count
    records = end.between
    if end.with_zip64:
        at = len(body) + len(directory) if end.located_at is None else end.located_at
        true_count = len(listed) if end.zip64_count is None else end.zip64_count
        true_offset = len(body) if end.zip64_offset is None else end.zip64_offset
        records += _END64.pack(
            *(b"PK\x06\x06", end.zip64_size, 45, 45, 0, 0, true_count, true_count),
            *(len(directory), true_offset),
        )
        records += _LOCATOR.pack(b"PK\x06\x07", 0, at, 1)
    last = _END.pack(
        *(b"PK\x05\x06", end.disk, end.disk, disk_count, count),
        *(size, offset, len(end.comment)),
    )
    return records + last + end.comment


def _entry(member: ZipMember, offset: int) -> tuple[bytes, bytes]:
    lie, packed = member.lie, member.packed
    method = 8 if lie.method is None else lie.method
    crc = zlib.crc32(member.data) if lie.crc is None else lie.crc
    size = len(member.data) if lie.size is None else lie.size
    flags = lie.flags | (0x800 if not member.name.isascii() and lie.raw_name is None else 0)
    name = member.name.encode() if lie.raw_name is None else lie.raw_name
    local_name = name if lie.local_name is None else lie.local_name.encode()
    local_packed = len(packed) if lie.local_size is None else lie.local_size
    local = _LOCAL.pack(
        *(b"PK\x03\x04", 20, flags if lie.local_flags is None else lie.local_flags),
        *(method if lie.local_method is None else lie.local_method, 0, 0x21),
        *(crc if lie.local_crc is None else lie.local_crc, local_packed, size),
        *(len(local_name), len(lie.local_extra)),
    )
    central = _CENTRAL.pack(
        *(b"PK\x01\x02", 0x314, 20, flags, method, 0, 0x21, crc, len(packed), size),
        *(len(name), len(lie.extra), len(lie.comment), lie.disk, 0),
        *(lie.mode << 16 | lie.attributes, offset),
    )
    body = local + local_name + lie.local_extra + packed + lie.after
    return body, central + name + lie.extra + lie.comment


@dataclass(frozen=True)
class WheelBuilder:
    """A wheel that is right in all that is not changed."""

    files: Mapping[str, bytes] = field(default_factory=lambda: {"evil/__init__.py": b"X = 1\n"})
    lies: Mapping[str, Lie] = field(default_factory=dict)
    without: Sequence[str] = ()
    """Metadata files left out."""
    record: bytes | None = None
    """RECORD's text; None: the true one."""
    info: str = INFO
    metadata: bytes = METADATA
    wheel: bytes = WHEEL
    extra: tuple[ZipMember, ...] = ()
    """Further raw members, in RECORD like the others."""
    prefix: bytes = b""
    suffix: bytes = b""
    end: End = End()

    def bytes(self) -> bytes:
        """The wheel file."""
        described = {f"{self.info}/METADATA": self.metadata, f"{self.info}/WHEEL": self.wheel}
        kept = {p: data for p, data in {**self.files, **described}.items() if p not in self.without}
        listed = [*kept.items(), *((m.name, m.data) for m in self.extra)]
        record = self.record
        if record is None:
            record = record_of(dict(listed), f"{self.info}/RECORD")
        archive = ZipBuilder(prefix=self.prefix, suffix=self.suffix, end=self.end)
        for path, data in kept.items():
            archive = archive.add(path, data, self.lies.get(path, Lie()))
        for member in self.extra:
            archive = archive.add(member.name, member.data, member.lie)
        if f"{self.info}/RECORD" not in self.without:
            archive = archive.add(f"{self.info}/RECORD", record)
        return archive.bytes()

    def write(self, folder: Path, name: str = NAME) -> Path:
        """Write the wheel into a folder."""
        path = folder / name
        path.write_bytes(self.bytes())
        return path


def record_of(files: Mapping[str, bytes], record: str) -> bytes:
    """The true RECORD of some files."""
    rows = [f"{path},sha256={digest(data)},{len(data)}" for path, data in files.items()]
    return ("\n".join([*rows, f"{record},,"]) + "\n").encode()


def digest(data: bytes) -> str:
    """A digest as RECORD has it."""
    return base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()

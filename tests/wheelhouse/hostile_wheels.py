"""Wheels that are wrong in one way each, built byte by byte where zipfile would not write them.

ZipBuilder().add("a/__init__.py", b"").bytes()
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


@dataclass(frozen=True)
class Lie:
    """Where a member's headers say something other than the truth; None: the truth."""

    local_name: str | None = None
    local_size: int | None = None
    size: int | None = None
    crc: int | None = None
    flags: int = 0
    method: int | None = None
    mode: int = 0o100644
    is_unlisted: bool = False
    """In the file, but not in its directory."""


@dataclass(frozen=True)
class ZipMember:
    """A member as it is to be written."""

    name: str
    data: bytes
    lie: Lie = Lie()


@dataclass(frozen=True)
class ZipBuilder:
    """A zip file under construction; every step returns a new one."""

    members: tuple[ZipMember, ...] = ()
    prefix: bytes = b""
    suffix: bytes = b""
    overlaid: bool = False
    """Every directory entry points at the first member's bytes."""

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
        count = len(listed)
        end = _END.pack(b"PK\x05\x06", 0, 0, count, count, len(directory), len(body), 0)
        return bytes(body + directory + end) + self.suffix


def _entry(member: ZipMember, offset: int) -> tuple[bytes, bytes]:
    lie = member.lie
    packer = zlib.compressobj(9, zlib.DEFLATED, -zlib.MAX_WBITS)
    packed = packer.compress(member.data) + packer.flush()
    method = 8 if lie.method is None else lie.method
    crc = zlib.crc32(member.data) if lie.crc is None else lie.crc
    size = len(member.data) if lie.size is None else lie.size
    flags = lie.flags | (0x800 if not member.name.isascii() else 0)
    name = member.name.encode()
    local_name = name if lie.local_name is None else lie.local_name.encode()
    local_packed = len(packed) if lie.local_size is None else lie.local_size
    local = _LOCAL.pack(
        *(b"PK\x03\x04", 20, flags, method, 0, 0x21),
        *(crc, local_packed, size, len(local_name), 0),
    )
    central = _CENTRAL.pack(
        *(b"PK\x01\x02", 0x314, 20, flags, method, 0, 0x21),
        *(crc, len(packed), size, len(name), 0, 0, 0, 0, lie.mode << 16, offset),
    )
    return local + local_name + packed, central + name


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
    extra: tuple[ZipMember, ...] = ()
    """Further raw members, in RECORD like the others."""
    prefix: bytes = b""
    suffix: bytes = b""

    def bytes(self) -> bytes:
        """The wheel file."""
        files = {**self.files, f"{self.info}/METADATA": METADATA, f"{self.info}/WHEEL": WHEEL}
        kept = {path: data for path, data in files.items() if path not in self.without}
        listed = [*kept.items(), *((m.name, m.data) for m in self.extra)]
        record = self.record
        if record is None:
            record = record_of(dict(listed), f"{self.info}/RECORD")
        archive = ZipBuilder(prefix=self.prefix, suffix=self.suffix)
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

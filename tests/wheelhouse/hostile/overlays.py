"""Members that lie over one another: small files that unpack to much."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

from tests.wheelhouse.hostile.case import INIT, HostileWheel
from tests.wheelhouse.hostile_wheels import ZipBuilder

CODE = "WHEEL_BOMB"
_LOCAL = struct.Struct("<4s5H3L2H")
_CENTRAL = struct.Struct("<4s6H3L5H2L")
_END = struct.Struct("<4s4H2LH")


def _same_bytes(canary: Path) -> bytes:
    """Two names for one member's bytes."""
    archive = ZipBuilder(overlaid=True).add(INIT, bytes(5000)).add("evil/copy.py", bytes(5000))
    return archive.bytes()


def quoted(count: int, size: int) -> bytes:
    """A bomb whose members quote one another's headers, so that each reaches to the last's bytes.

    Each member's packed bytes are a stored block that holds the next member's header, and then
    that member's own packed bytes (Fifield, "A better zip bomb").
    """
    packer = zlib.compressobj(9, zlib.DEFLATED, -zlib.MAX_WBITS)
    kernel = packer.compress(bytes(size)) + packer.flush()
    data, crc, body = bytes(size), zlib.crc32(bytes(size)), kernel
    members: list[tuple[bytes, int, int, int]] = []
    for number in reversed(range(count)):
        name = f"evil/{number}.bin".encode()
        header = _LOCAL.pack(
            *(b"PK\x03\x04", 20, 0, 8, 0, 0x21, crc, len(body), len(data), len(name), 0)
        )
        members.append((name, crc, len(body), len(data)))
        whole = header + name + body
        quote = struct.pack("<BHH", 0, len(header + name), 0xFFFF ^ len(header + name))
        data, body = header + name + data, quote + whole
        crc = zlib.crc32(data)
    return _with_directory(whole, list(reversed(members)))


def _with_directory(body: bytes, members: list[tuple[bytes, int, int, int]]) -> bytes:
    directory, offset = b"", 0
    for name, crc, packed, size in members:
        directory += _CENTRAL.pack(
            *(b"PK\x01\x02", 0x314, 20, 0, 8, 0, 0x21, crc, packed, size),
            *(len(name), 0, 0, 0, 0, 0o100644 << 16, offset),
        )
        directory += name
        offset += _LOCAL.size + len(name) + 5
    end = _END.pack(
        *(b"PK\x05\x06", 0, 0, len(members), len(members), len(directory), len(body), 0)
    )
    return body + directory + end


WHEELS: tuple[HostileWheel, ...] = (
    HostileWheel(
        "two-names-for-one-member",
        "WHEEL_STRUCTURE",
        _same_bytes,
    ),
    HostileWheel(
        "headers-quoted",
        CODE,
        lambda canary: quoted(40, 100_000),
    ),
)

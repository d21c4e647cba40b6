"""Files that two readers of zip files would read differently: in the members' own headers."""

from __future__ import annotations

import struct
import zlib

from tests.wheelhouse.hostile.case import INIT, SOURCE, HostileWheel, built, raw
from tests.wheelhouse.hostile_wheels import Lie, WheelBuilder

CODE = "WHEEL_STRUCTURE"
_MANY = 0xFFFFFFFF


def _lie(name: str, lie: Lie) -> HostileWheel:
    return built(name, CODE, WheelBuilder(lies={INIT: lie}))


def _named(name: str, path: str, lie: Lie) -> HostileWheel:
    builder = WheelBuilder(extra=(raw(path, b"x", lie),))
    return built(name, CODE, builder)


def _extra(kind: int, body: bytes) -> bytes:
    return struct.pack("<HH", kind, len(body)) + body


def _unicode_path(name: bytes) -> bytes:
    """Info-ZIP's other name of a member, by which it goes instead."""
    return _extra(0x7075, struct.pack("<BL", 1, zlib.crc32(INIT.encode())) + name)


def _descriptor(crc: int, packed: int, size: int, *, signed: bool = True) -> bytes:
    return (b"PK\x07\x08" if signed else b"") + struct.pack("<3L", crc, packed, size)


_CRC = zlib.crc32(SOURCE)
_PACKED = len(raw(INIT, SOURCE).packed)
_TOLD_LATER = {"flags": 8, "local_crc": 0, "local_size": 0}

WHEELS: tuple[HostileWheel, ...] = (
    _lie("other-name-inside", Lie(local_name="evil/b.py")),
    _lie("other-size-inside", Lie(local_size=1)),
    _lie("other-checksum-inside", Lie(local_crc=1)),
    _lie("other-method-inside", Lie(local_method=0)),
    _lie("other-flags-inside", Lie(local_flags=8)),
    _lie("encrypted", Lie(flags=1)),
    _lie("strongly-encrypted", Lie(flags=0x41)),
    _lie("patched-data", Lie(flags=0x20)),
    _lie("masked-headers", Lie(flags=0x2000)),
    _lie("bzip2", Lie(method=12)),
    _lie("lzma", Lie(method=14)),
    _lie("unknown-method", Lie(method=99)),
    _lie("on-another-disk", Lie(disk=3)),
    _lie("comment-of-a-member", Lie(comment=b"PK\x05\x06" + bytes(18))),
    _lie("other-name-in-extra-field", Lie(extra=_unicode_path(b"evil/c.py"))),
    _lie("other-name-in-own-extra-field", Lie(local_extra=_unicode_path(b"evil/c.py"))),
    _lie("extra-field-cut-off", Lie(local_extra=b"\x01\x00\x10")),
    _lie("extra-field-too-long", Lie(local_extra=struct.pack("<HH", 0x5455, 90))),
    _lie(
        "zip64-sizes-twice",
        Lie(local_extra=2 * _extra(1, struct.pack("<QQ", len(SOURCE), _PACKED))),
    ),
    _lie("zip64-sizes-lie", Lie(local_extra=_extra(1, struct.pack("<QQ", 9, 9)))),
    _lie("zip64-size-of-one", Lie(local_extra=_extra(1, struct.pack("<Q", len(SOURCE))))),
    _lie("zip64-sizes-missing", Lie(local_size=_MANY)),
    _lie("zip64-in-directory-unneeded", Lie(extra=_extra(1, struct.pack("<Q", 9)))),
    _lie(
        "descriptor-lies",
        Lie(**_TOLD_LATER, after=_descriptor(1, _PACKED, len(SOURCE))),  # type: ignore[arg-type]
    ),
    _lie(
        "descriptor-missing",
        Lie(**_TOLD_LATER),  # type: ignore[arg-type]  # integers all
    ),
    _lie("descriptor-unannounced", Lie(after=_descriptor(_CRC, _PACKED, len(SOURCE)))),
    _named(
        "name-in-no-known-encoding",
        "evil/é.py",
        Lie(raw_name=b"evil/\xe9.py"),
    ),
    _named(
        "name-marked-as-utf-8-is-none",
        "evil/é.py",
        Lie(raw_name=b"evil/\xe9.py", flags=0x800),
    ),
)

"""Files that two readers of zip files would read differently: around the members."""

from __future__ import annotations

import struct
from dataclasses import replace

from tests.wheelhouse.hostile.case import INIT, HostileWheel, built, raw
from tests.wheelhouse.hostile_wheels import INFO, NAME, End, Lie, WheelBuilder, ZipBuilder

CODE = "WHEEL_STRUCTURE"
OTHER = ZipBuilder().add("other.py", b"x").bytes()
PLAIN = WheelBuilder()


def _of(name: str, builder: WheelBuilder) -> HostileWheel:
    return built(name, CODE, builder)


def _bytes(name: str, data: bytes, *, filename: str = NAME) -> HostileWheel:
    return HostileWheel(name, CODE, lambda canary: data, filename)


def _ending(name: str, **lies: int | bytes | bool) -> HostileWheel:
    end = replace(End(), **lies)  # type: ignore[arg-type]  # each case names its lie
    return _of(name, replace(PLAIN, end=end))


def _cut(end: int) -> bytes:
    return PLAIN.bytes()[:end]


def _moved_prefix() -> bytes:
    """Bytes before the archive, with offsets that count from the archive's own beginning."""
    return b"#!/bin/sh\nexit\n" + PLAIN.bytes()


WHEELS: tuple[HostileWheel, ...] = (
    _bytes("empty-file", b""),
    _bytes("two-bytes", b"PK"),
    _bytes("text", b"not a zip file at all" * 9),
    _bytes("cut-in-half", _cut(len(PLAIN.bytes()) // 2)),
    _bytes("end-cut-off", _cut(-22)),
    _bytes("end-cut-short", _cut(-3)),
    _bytes("only-an-end", PLAIN.bytes()[-22:]),
    _bytes("no-members", struct.pack("<4s4H2LH", b"PK\x05\x06", *(0,) * 7)),
    _of("script-before", WheelBuilder(prefix=b"#!/bin/sh\n")),
    _bytes("script-before-old-offsets", _moved_prefix()),
    _of("bytes-after", WheelBuilder(suffix=b"trailing")),
    _of("second-archive-after", WheelBuilder(suffix=OTHER)),
    _ending("comment", comment=b"a comment"),
    _ending("end-in-comment", comment=PLAIN.bytes()[-22:]),
    _ending("bytes-before-end", between=b"x" * 40),
    _ending("count-too-low", count=1),
    _ending("count-too-high", count=9),
    _ending("count-of-disk-differs", disk_count=1),
    _ending("second-disk", disk=1),
    _ending("directory-offset-lies", directory_offset=7),
    _ending("directory-too-short", directory_size=46),
    _ending("zip64-count-lies", with_zip64=True, zip64_count=2),
    _ending("zip64-offset-lies", with_zip64=True, zip64_offset=11),
    _ending("zip64-located-elsewhere", with_zip64=True, located_at=0),
    _ending("zip64-with-more-data", with_zip64=True, zip64_size=52),
    _ending("zip64-claimed-not-there", count=0xFFFF, disk_count=0xFFFF),
    _of(
        "member-not-in-directory",
        WheelBuilder(extra=(raw("hidden.py", b"x", Lie(is_unlisted=True)),)),
    ),
    _of("bytes-between-members", WheelBuilder(lies={INIT: Lie(after=b"x" * 60)})),
    _of("few-bytes-between-members", WheelBuilder(lies={INIT: Lie(after=b"abcd")})),
    _of("name-twice", WheelBuilder(extra=(raw(INIT, b"Y = 2\n"),))),
    _of("no-wheel-file", WheelBuilder(without=(f"{INFO}/WHEEL",))),
    _of("dist-info-of-another", WheelBuilder(info="other-1.0.dist-info")),
    _of("dist-info-of-another-version", WheelBuilder(info="evil-2.0.dist-info")),
    _of(
        "no-dist-info-at-all",
        WheelBuilder(without=tuple(f"{INFO}/{n}" for n in ("WHEEL", "METADATA", "RECORD"))),
    ),
    _bytes("no-name-of-a-wheel", PLAIN.bytes(), filename="evil.whl"),
    _bytes("version-that-is-none", PLAIN.bytes(), filename="evil-x-py3-none-any.whl"),
)

"""Wheels that would take more memory, disk or time than any honest one."""

from __future__ import annotations

from pathlib import Path

from tests.wheelhouse.hostile.case import INIT, HostileWheel, with_file
from tests.wheelhouse.hostile_wheels import INFO, METADATA, Lie, WheelBuilder, ZipBuilder, ZipMember

CODE = "WHEEL_BOMB"
_MB = 1024**2


def _bomb(name: str, builder: WheelBuilder) -> HostileWheel:
    return HostileWheel(
        name,
        CODE,
        lambda canary: builder.bytes(),
    )


def _crowd(canary: Path) -> bytes:
    return ZipBuilder(
        tuple(ZipMember(f"evil/{n}", b"", Lie(method=0)) for n in range(20_001))
    ).bytes()


def _folders(canary: Path) -> bytes:
    path = "/".join(["d"] * 400)
    return with_file(f"evil/{path}/x.py").bytes()


def _many_declared(canary: Path) -> bytes:
    """No single member is much; together they claim more than may be unpacked."""
    big = 1000 * _MB
    extra = tuple(ZipMember(f"evil/{n}.bin", bytes(1200 * 1024), Lie(size=big)) for n in range(9))
    return WheelBuilder(extra=extra).bytes()


def _noise(size: int) -> bytes:
    """Text that packs badly enough not to be a bomb by its ratio."""
    return b"".join(b"%d," % (number * number) for number in range(size // 10))[:size]


WHEELS: tuple[HostileWheel, ...] = (
    _bomb("zeros-by-the-megabyte", with_file("evil/zeros.bin", bytes(32 * _MB))),
    _bomb(
        "many-zeros-together",
        WheelBuilder(extra=tuple(ZipMember(f"evil/{n}.bin", bytes(_MB)) for n in range(40))),
    ),
    _bomb("declared-too-big", WheelBuilder(lies={INIT: Lie(size=3 * 1024**3)})),
    HostileWheel("too-big-together", CODE, _many_declared),
    HostileWheel("too-many-members", CODE, _crowd),
    HostileWheel("too-deep", "WHEEL_PATH", _folders),
    HostileWheel(
        "metadata-too-long",
        "WHEEL_METADATA",
        lambda canary: WheelBuilder(metadata=METADATA + b"\n" + _noise(5 * _MB)).bytes(),
    ),
    HostileWheel(
        "too-many-requirements",
        "WHEEL_METADATA",
        lambda canary: WheelBuilder(
            metadata=METADATA + b"Requires-Dist: a%s\n" % (b"a" * 100) * 3000
        ).bytes(),
    ),
    HostileWheel(
        "headers-without-end",
        "WHEEL_METADATA",
        lambda canary: WheelBuilder(metadata=METADATA + b"R:\n" * 200_000).bytes(),
    ),
    HostileWheel(
        "folded-header-without-end",
        "WHEEL_METADATA",
        lambda canary: WheelBuilder(metadata=METADATA + b"R: x\n" + b" x\n" * 200_000).bytes(),
    ),
    HostileWheel(
        "record-without-end",
        "WHEEL_RECORD",
        lambda canary: WheelBuilder(record=b"".join(b"%d,,\n" % n for n in range(60_000))).bytes(),
    ),
    HostileWheel(
        "entry-points-too-long",
        "WHEEL_METADATA",
        lambda canary: with_file(f"{INFO}/entry_points.txt", b"# " + _noise(2 * _MB)).bytes(),
    ),
)

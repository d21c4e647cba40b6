"""A wheel's metadata is not that of its name, or cannot be read."""

from __future__ import annotations

from tests.wheelhouse.hostile.case import (
    ENTRY_POINTS,
    METADATA_PATH,
    HostileWheel,
    built,
    with_file,
)
from tests.wheelhouse.hostile_wheels import METADATA, WHEEL, WheelBuilder

CODE = "WHEEL_METADATA"


def _metadata(name: str, text: bytes) -> HostileWheel:
    return built(name, CODE, WheelBuilder(metadata=text))


def _wheel(name: str, text: bytes) -> HostileWheel:
    return built(name, CODE, WheelBuilder(wheel=text))


def _entry_points(name: str, text: bytes) -> HostileWheel:
    return built(name, CODE, with_file(ENTRY_POINTS, text))


WHEELS: tuple[HostileWheel, ...] = (
    built("no-metadata", CODE, WheelBuilder(without=(METADATA_PATH,))),
    _metadata("metadata-empty", b""),
    _metadata("metadata-not-text", METADATA + b"Author: \xff\xfe\n"),
    _metadata("another-name", METADATA.replace(b"evil", b"pluggy")),
    _metadata("another-version", METADATA.replace(b"1.0", b"9.0")),
    _metadata("two-names", METADATA + b"Name: pluggy\n"),
    _metadata("version-is-none", METADATA.replace(b"Version: 1.0", b"Version: latest")),
    _metadata("requirement-cannot-be-read", METADATA + b"Requires-Dist: @@@ ???\n"),
    _metadata("requirement-by-address", METADATA + b"Requires-Dist: a @ file:///etc/passwd\n"),
    _metadata("requirement-too-deep", METADATA + b"Requires-Dist: a; " + b"(" * 5000 + b"\n"),
    _metadata("python-is-none", METADATA + b"Requires-Python: the newest\n"),
    _metadata("version-without-end", METADATA.replace(b"1.0", b"1" * 5000)),
    _metadata("python-without-end", METADATA + b"Requires-Python: >=" + b"1" * 5000 + b"\n"),
    _wheel("tags-without-end", WHEEL + b"Tag: " + b"-".join([b".".join([b"a"] * 900)] * 3) + b"\n"),
    _wheel("wheel-file-empty", b""),
    _wheel("newer-wheel-format", WHEEL.replace(b"Wheel-Version: 1.0", b"Wheel-Version: 2.0")),
    _wheel("wheel-format-is-none", WHEEL.replace(b"Wheel-Version: 1.0", b"Wheel-Version: new")),
    _wheel("purelib-is-neither", WHEEL.replace(b"Purelib: true", b"Purelib: perhaps")),
    _wheel("other-tag-inside", WHEEL.replace(b"py3-none-any", b"cp311-cp311-linux_aarch64")),
    _wheel("tag-is-none", WHEEL.replace(b"py3-none-any", b"py3")),
    _entry_points("entry-points-are-garbage", b"\x00\x01[[[\n= = =\n"),
    _entry_points("entry-points-not-text", b"[nondum.plugins]\na = \xff\xfe\n"),
    _entry_points("entry-point-outside-section", b"a = b:c\n"),
    _entry_points("entry-point-twice", b"[nondum.plugins]\na = b:c\na = d:e\n"),
    _entry_points("entry-point-is-no-object", b"[nondum.plugins]\na = os.system('id')\n"),
    built(
        "tags-of-the-name-lie",
        CODE,
        WheelBuilder(),
        "evil-1.0-cp311-cp311-manylinux_2_17_x86_64.whl",
    ),
)

"""Wheels whose modules are machine code for another processor than their names say."""

from __future__ import annotations

import struct

from tests.wheelhouse.hostile.case import INIT, SOURCE, HostileWheel, built
from tests.wheelhouse.hostile_wheels import Lie, WheelBuilder, ZipMember

from nondum.wheelhouse.wheels.elf import ARCHITECTURES, Elf

CODE = "WHEEL_MACHINE"
X86, ARM, ARM_32, X86_32 = (ARCHITECTURES[name] for name in ("x86_64", "aarch64", "armv7l", "i686"))
MODULE = "evil/_core.cpython-311-x86_64-linux-gnu.so"
SO = 3
"""e_type of shared objects."""


def elf(kind: Elf, holds: bytes = b"\0PyInit__core\0") -> bytes:
    """A file that begins as an ELF file does, and holds names of functions."""
    ident = bytes([*b"\x7fELF", kind.bits // 32, {"little": 1, "big": 2}[kind.order], 1])
    order = "<" if kind.order == "little" else ">"
    return ident.ljust(16, b"\0") + struct.pack(f"{order}2H", SO, kind.machine) + holds


def tagged(*tags: str) -> tuple[str, bytes]:
    """A wheel's file name and WHEEL, for such tags."""
    interpreter, abi, _ = tags[0].split("-")
    platforms = ".".join(tag.split("-")[2] for tag in tags)
    head = b"Wheel-Version: 1.0\nGenerator: test\nRoot-Is-Purelib: false\n"
    said = "".join(f"Tag: {tag}\n" for tag in tags).encode()
    return f"evil-1.0-{interpreter}-{abi}-{platforms}.whl", head + said


def native(
    files: dict[str, bytes], *tags: str, stored: tuple[str, ...] = ()
) -> tuple[str, WheelBuilder]:
    """The file name of a compiled wheel, and what builds it; `stored` files are not deflated."""
    name, said = tagged(*(tags or ("cp311-cp311-manylinux_2_28_x86_64",)))
    lies = {path: Lie(method=0) for path in stored}
    return name, WheelBuilder(files={INIT: SOURCE, **files}, wheel=said, lies=lies)


def _of(name: str, files: dict[str, bytes], *tags: str, stored: bool = False) -> HostileWheel:
    filename, builder = native(files, *tags, stored=tuple(files) if stored else ())
    return built(name, CODE, builder, filename)


def _over_another() -> HostileWheel:
    """A module that is there for the right machine, and again in a library's place."""
    filename, builder = native({MODULE: elf(X86)})
    bad = ZipMember("evil.libs/libevil-1a2b.so.3", elf(ARM))
    builder = WheelBuilder(files=builder.files, wheel=builder.wheel, extra=(bad,))
    return built("library-of-another-machine", CODE, builder, filename)


WHEELS: tuple[HostileWheel, ...] = (
    _of("module-of-another-machine", {MODULE: elf(ARM)}),
    _of("module-of-another-machine-stored", {MODULE: elf(ARM)}, stored=True),
    _of("module-of-32-bits", {MODULE: elf(X86_32)}),
    _of("module-of-another-abi", {MODULE: elf(Elf(32, "little", X86.machine))}),
    _of("module-of-another-byte-order", {MODULE: elf(Elf(64, "big", X86.machine))}),
    _of("module-of-no-machine", {MODULE: elf(Elf(64, "little", 0))}),
    _of("module-on-top", {"_evil.cpython-311-x86_64-linux-gnu.so": elf(ARM)}),
    _of("module-in-platlib", {f"evil-1.0.data/platlib/{MODULE}": elf(ARM)}),
    _of("one-module-of-two", {MODULE: elf(X86), "evil/_x.abi3.so": elf(ARM, b"\0PyInit__x\0")}),
    _of("stable-module", {"evil/_core.abi3.so": elf(ARM)}, "cp311-abi3-manylinux_2_28_x86_64"),
    _of("plain-module", {"evil/_core.so": elf(ARM)}),
    _of(
        "module-with-the-name-far-inside",
        {"evil/_core.so": elf(ARM, b"\0" * (2**20 - 30) + b"PyInit__core\0")},
        stored=True,
    ),
    _of(
        "built-on-a-pc-named-for-a-board",
        {"evil/_core.cpython-311-aarch64-linux-gnu.so": elf(X86)},
        "cp311-cp311-linux_aarch64",
    ),
    _of(
        "built-on-a-board-named-for-an-older-one",
        {"evil/_core.cpython-311-arm-linux-gnueabihf.so": elf(ARM)},
        "cp311-cp311-linux_armv6l",
        "cp311-cp311-linux_armv7l",
    ),
    _over_another(),
)

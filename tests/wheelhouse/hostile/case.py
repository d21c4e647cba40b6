"""One hostile wheel: how it is made, and what refuses it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from tests.wheelhouse.hostile_wheels import INFO, NAME, Lie, WheelBuilder, ZipMember

TRUTH = Lie()
INIT = "evil/__init__.py"
SOURCE = b"X = 1\n"
RECORD = f"{INFO}/RECORD"
METADATA_PATH = f"{INFO}/METADATA"
WHEEL_PATH = f"{INFO}/WHEEL"
ENTRY_POINTS = f"{INFO}/entry_points.txt"


@dataclass(frozen=True)
class HostileWheel:
    """A wheel that must be refused."""

    name: str
    """What is wrong with it, in a word or two."""
    code: str
    """The one code that it is refused with."""
    build: Callable[[Path], bytes]
    """Its bytes; given is the file that its code would make if it ever ran."""
    filename: str = NAME


def built(name: str, code: str, builder: WheelBuilder, filename: str = NAME) -> HostileWheel:
    """A hostile wheel without code."""
    return HostileWheel(name, code, lambda canary: builder.bytes(), filename)


def planted(name: str, code: str, path: str, *, line: bool = False) -> HostileWheel:
    """A hostile wheel with code at `path` that would make the canary."""

    def build(canary: Path) -> bytes:
        return with_file(path, code_for(canary, line=line)).bytes()

    return HostileWheel(name, code, build)


def code_for(canary: Path, *, line: bool = False) -> bytes:
    """Python that makes the canary; as one line, what a `.pth` file runs."""
    text = f"import pathlib; pathlib.Path({str(canary)!r}).touch()\n"
    return text.encode() if line else f"#!/usr/bin/env python3\n{text}".encode()


def with_file(path: str, data: bytes = b"x") -> WheelBuilder:
    """A wheel with one more file, in RECORD like the others."""
    return WheelBuilder(files={INIT: SOURCE, path: data})


def raw(name: str, data: bytes = b"x", lie: Lie = TRUTH) -> ZipMember:
    """A member as it is to be written."""
    return ZipMember(name, data, lie)

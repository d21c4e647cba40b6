"""What a payload is built for: an architecture and a Python, and the wheel tags that fit them."""

from __future__ import annotations

import platform
import sys
from collections.abc import Iterator
from dataclasses import dataclass

from nondum.sdk.errors import ConfigRefused, Problem

ARCHITECTURES = ("aarch64", "armv7l", "x86_64")
PYTHONS = ("3.11", "3.12", "3.13")
GLIBC_MINOR = 36
"""Debian 12 has glibc 2.36: wheels that need a newer one would not start there."""

_LEGACY = {17: "manylinux2014", 12: "manylinux2010", 5: "manylinux1"}


@dataclass(frozen=True, slots=True, order=True)
class Target:
    """One kind of host."""

    architecture: str
    """As `uname -m` says."""
    python: str
    """`3.11`."""

    @classmethod
    def here(cls) -> Target:
        """This machine and interpreter."""
        return cls(platform.machine(), f"{sys.version_info.major}.{sys.version_info.minor}")

    @property
    def marker(self) -> str:
        """The environment marker (PEP 508) that is true on such hosts."""
        return f"(python_version == '{self.python}' and platform_machine == '{self.architecture}')"

    def platforms(self) -> Iterator[str]:
        """Platform tags that such a host takes, best first."""
        for minor in range(GLIBC_MINOR, 4, -1):
            yield f"manylinux_2_{minor}_{self.architecture}"
            if minor in _LEGACY:
                yield f"{_LEGACY[minor]}_{self.architecture}"
        yield f"linux_{self.architecture}"


def targets(architectures: tuple[str, ...], pythons: tuple[str, ...]) -> tuple[Target, ...]:
    """Every pairing. Raises `ConfigRefused` (TARGET_UNKNOWN) for those that have no wheels."""
    problems = [
        Problem("TARGET_UNKNOWN", f"{a!r} is no architecture", need=" or ".join(ARCHITECTURES))
        for a in architectures
        if a not in ARCHITECTURES
    ]
    for python in pythons:
        major, _, minor = python.partition(".")
        if major != "3" or not minor.isdigit() or int(minor) < 11:
            text = f"{python!r} is no Python that workers run"
            problems.append(Problem("TARGET_UNKNOWN", text, need="3.11 or newer, as 3.12"))
    if problems:
        raise ConfigRefused(*problems)
    return tuple(Target(a, p) for a in architectures for p in pythons)

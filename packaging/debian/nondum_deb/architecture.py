"""The processors that there are packages for, in Debian's words and in those of wheels."""

from __future__ import annotations

import platform
from dataclasses import dataclass

GLIBC = (36, 35, 34, 31, 28, 27, 26, 24, 17)
"""Minor versions of glibc 2 that wheels may ask for: Debian 12 has 2.36, newer systems more."""


@dataclass(frozen=True, slots=True)
class Architecture:
    """One of them."""

    debian: str
    machine: str
    """As `uname -m` and wheels' tags call it."""

    @property
    def platforms(self) -> tuple[str, ...]:
        """Tags of wheels that run on it, best first (PEP 600)."""
        new = (f"manylinux_2_{minor}_{self.machine}" for minor in GLIBC)
        return (*new, f"manylinux2014_{self.machine}")

    def of_pip(self, python: str) -> tuple[str, ...]:
        """pip's options for wheels of this architecture and of a Python (`3.12`), whichever the
        machine has that pip runs on."""
        version = ("--python-version", python, "--implementation", "cp")
        platforms = (f"--platform={name}" for name in self.platforms)
        return ("--only-binary=:all:", *version, *platforms)


AMD64 = Architecture("amd64", "x86_64")
ARM64 = Architecture("arm64", "aarch64")
ARCHITECTURES = {known.debian: known for known in (AMD64, ARM64)}


def here() -> Architecture | None:
    """The one of this machine, if there are packages for it."""
    known = [a for a in ARCHITECTURES.values() if a.machine == platform.machine()]
    return known[0] if known else None

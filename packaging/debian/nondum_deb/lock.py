"""Other people's wheels that go into the packages, and those that build nondum's own: versions and
hashes, of all architectures and Pythons.

Files in the words of pip (`--require-hashes`), so that it is pip who holds what it fetches to them.
"""

from __future__ import annotations

import hashlib
import itertools
import tempfile
from collections.abc import Iterable, Sequence
from pathlib import Path

from nondum_deb.architecture import ARCHITECTURES, Architecture
from nondum_deb.command import PIP, call
from nondum_deb.places import BACKEND_LOCK, LOCK, PYTHONS, declared, declared_backend

HEAD = """\
# What is in the Debian packages besides nondum: exact versions, with the hashes of the wheels of
# every architecture and Python. Written by `./run package --lock`.
"""
BACKEND_HEAD = """\
# What builds nondum's own wheels for the packages: exact versions, with hashes. Written by
# `./run package --lock`.
"""


def download(architecture: Architecture, python: str, folder: Path, *what: str) -> None:
    """Fetch wheels that run on an architecture and a Python, whatever this machine's are."""
    call(*PIP, "download", "-d", folder, *architecture.of_pip(python), *what)


def locked_wheels(architecture: Architecture, python: str, folder: Path) -> None:
    """Fetch what the lock names. Raises `BuildFailed` where a hash is not one of its."""
    download(architecture, python, folder, "--no-deps", "--require-hashes", "-r", str(LOCK))


def install_backend(folder: Path) -> None:
    """Unpack what builds wheels, and nothing else. Raises `BuildFailed` where a hash is not one of
    the lock's."""
    held = ("--only-binary=:all:", "--no-deps", "--require-hashes", "-r", str(BACKEND_LOCK))
    call(*PIP, "install", "--target", folder, "--no-compile", *held)


def write(path: Path = LOCK, backend: Path = BACKEND_LOCK) -> None:
    """Write both locks again, with the newest versions that there are."""
    path.write_text(HEAD + "".join(_newest(declared())), encoding="utf-8")
    backend.write_text(BACKEND_HEAD + "".join(_newest(declared_backend())), encoding="utf-8")


def _newest(wanted: Sequence[str]) -> list[str]:
    """Chosen for the oldest Python: every other one gets the same versions."""
    wheels: list[tuple[str, str, str]] = []
    with tempfile.TemporaryDirectory(prefix="nondum-lock-") as scratch:
        for python, architecture in itertools.product(PYTHONS, ARCHITECTURES.values()):
            folder = Path(scratch, python, architecture.debian)
            pinned = sorted({f"{name}=={version}" for name, version, _ in wheels})
            held = ("--no-deps", *pinned) if pinned else wanted
            download(architecture, python, folder, *held)
            wheels += map(_entry, folder.glob("*.whl"))
    return _lines(wheels)


def _entry(wheel: Path) -> tuple[str, str, str]:
    name, version, _ = wheel.name.split("-", 2)
    return name.replace("_", "-").lower(), version, hashlib.sha256(wheel.read_bytes()).hexdigest()


def _lines(wheels: Iterable[tuple[str, str, str]]) -> list[str]:
    pinned: dict[tuple[str, str], set[str]] = {}
    for name, version, digest in wheels:
        pinned.setdefault((name, version), set()).add(digest)
    return [
        " \\\n    ".join((f"{name}=={version}", *(f"--hash=sha256:{d}" for d in sorted(digests))))
        + "\n"
        for (name, version), digests in sorted(pinned.items())
    ]

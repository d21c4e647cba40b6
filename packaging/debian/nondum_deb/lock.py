"""Other people's wheels that go into the packages: versions and hashes, of all architectures.

A file in the words of pip (`--require-hashes`), so that it is pip who holds what it fetches to it.
"""

from __future__ import annotations

import hashlib
import tempfile
from collections.abc import Iterable
from pathlib import Path

from nondum_deb.architecture import ARCHITECTURES, Architecture
from nondum_deb.command import PIP, call
from nondum_deb.places import LOCK, declared

HEAD = """\
# What is in the Debian packages besides nondum: exact versions, with the hashes of the wheels of
# every architecture. Written by `./run package --lock`.
"""


def download(architecture: Architecture, folder: Path, *what: str) -> None:
    """Fetch wheels that run on an architecture, whatever this machine's is."""
    call(*PIP, "download", "-d", folder, *architecture.of_pip, *what)


def locked_wheels(architecture: Architecture, folder: Path) -> None:
    """Fetch what the lock names. Raises `BuildFailed` where a hash is not one of its."""
    download(architecture, folder, "--no-deps", "--require-hashes", "-r", str(LOCK))


def write(path: Path = LOCK) -> None:
    """Write the lock anew, with the newest versions that there are."""
    wheels: list[tuple[str, str, str]] = []
    with tempfile.TemporaryDirectory(prefix="nondum-lock-") as scratch:
        for architecture in ARCHITECTURES.values():
            folder = Path(scratch, architecture.debian)
            download(architecture, folder, *declared())
            wheels += map(_entry, folder.glob("*.whl"))
    path.write_text(HEAD + "".join(_lines(wheels)), encoding="utf-8")


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

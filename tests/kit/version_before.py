"""Files of the version before; `tests/data/version_before` says what they are, and makes them."""

from __future__ import annotations

import contextlib
import functools
import json
import sqlite3
import tarfile
from pathlib import Path
from typing import Any

DATA = Path(__file__).parents[1] / "data/version_before"
WORK = "/var/tmp/nondum-version-before"
"""Where its daemon ran."""
CRIER = "org.example.crier"


def unpack(work: Path) -> Path:
    """Lay out `drive` and `state` below a folder, as if the daemon had always run there; gives the
    drive."""
    with tarfile.open(DATA / "host.tar.xz") as archive:
        archive.extractall(work, filter="tar")
    catalogue = sqlite3.connect(work / "state/catalogue.sqlite")
    with contextlib.closing(catalogue), catalogue:
        for table, column in (
            ("drives", "root"),
            ("sources", "folder"),
            ("components", "venv"),
            ("components", "site_packages"),
            ("components", "scratch"),
        ):
            moved = f"UPDATE {table} SET {column} = replace({column}, ?, ?)"
            catalogue.execute(moved, (WORK, str(work)))
    return work / "drive"


def said(host: str) -> tuple[bytes, ...]:
    """All messages that a host (`before`, `other`) sent to its only peer, in their order."""
    return tuple(map(bytes.fromhex, _recorded()["hosts"][host]))


def packets(name: str) -> tuple[bytes, ...]:
    """The parts of a packet by its name."""
    return tuple(map(bytes.fromhex, _recorded()["packets"][name]))


@functools.cache
def _recorded() -> dict[str, Any]:
    found: dict[str, Any] = json.loads((DATA / "recorded.json").read_text(encoding="ascii"))
    return found

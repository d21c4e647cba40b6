"""A folder of WAV files: each that is put there is heard once."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

HEARD = ".heard"
"""Suffix of files that have been taken: a restart must not hear a goal again."""
UNFINISHED_S = 2.0
"""A file that was written to a shorter time ago, and is no WAV file yet, may become one."""


class Inbox:
    """Takes files out of a folder, oldest first."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)

    def waiting(self) -> Iterator[Path]:
        """The files that nobody has taken, oldest first."""
        found = [path for path in self.folder.glob("*.wav") if path.is_file()]
        yield from sorted(found, key=lambda path: (path.stat().st_mtime_ns, path.name))

    def take(self, path: Path) -> Path:
        """Mark a file as heard *before* it is heard: it is never heard twice. Raises `OSError`."""
        return path.rename(path.with_name(path.name + HEARD))


def may_grow(path: Path) -> bool:
    """Whether somebody may still be writing a file."""
    return time.time() - path.stat().st_mtime < UNFINISHED_S

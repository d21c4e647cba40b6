"""A folder of WAV files: each that is put there is heard once."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator
from pathlib import Path

HEARD = ".heard"
"""Suffix of files that have been taken: a restart must not hear a goal again."""
UNFINISHED_S = 2.0
"""A file that was written to a shorter time ago, and is no WAV file yet, may become one."""
MARK_BYTES = 100
"""No mark is longer."""


class Inbox:
    """Takes files out of a folder, oldest first."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._given_up: dict[Path, bytes] = {}
        """Files that can be neither renamed nor marked, and their marks."""
        folder.mkdir(parents=True, exist_ok=True)

    def waiting(self) -> Iterator[Path]:
        """The files that were not taken yet, oldest first."""
        found: list[tuple[int, Path]] = []
        for path in self.folder.glob("*.wav"):
            with contextlib.suppress(OSError):  # it has gone meanwhile
                mark = _mark(path)
                if path.is_file() and mark not in (self._given_up.get(path), _marked(path)):
                    found.append((path.stat().st_mtime_ns, path))
        yield from (path for _, path in sorted(found))

    def take(self, path: Path) -> None:
        """Mark a file as heard *before* it is heard: it is never heard twice.

        It is renamed. One that this user may not rename, as one of root's in a mount with mapped
        users (EOVERFLOW), stays, and a mark lies beside it. Raises `OSError`.
        """
        heard = _taken_path(path)
        try:
            path.rename(heard)
        except OSError:
            heard.write_bytes(_mark(path))

    def give_up(self, path: Path) -> None:
        """Never hear a file that cannot be taken. Raises `OSError` if it has gone."""
        self._given_up[path] = _mark(path)


def may_grow(path: Path) -> bool:
    """Whether somebody may still be writing a file."""
    return time.time() - path.stat().st_mtime < UNFINISHED_S


def _taken_path(path: Path) -> Path:
    return path.with_name(path.name + HEARD)


def _mark(path: Path) -> bytes:
    """Which file it is; not when it was written: a copy may be given its time afterwards."""
    status = path.stat()
    return f"file {status.st_ino} of {status.st_size} bytes\n".encode()


def _marked(path: Path) -> bytes | None:
    """The mark that lies beside a file; what lies there may be another recording, too."""
    try:
        with _taken_path(path).open("rb") as heard:
            return heard.read(MARK_BYTES)
    except OSError:
        return None

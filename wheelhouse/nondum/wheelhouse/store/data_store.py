"""Data that payloads brought, by hash, so that what comes again need not be copied again.

A payload has its files in its folder; here is another link to each, which stays when the payload
goes, as long as the quota lasts.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from nondum.sdk.errors import InstallFailed, Problem
from nondum.wheelhouse.format.contents import Entry
from nondum.wheelhouse.store import checking, disk
from nondum.wheelhouse.store.quota import Kept
from nondum.wheelhouse.store.unpacking import StoredFile


class DataStore:
    """A folder of files, each named by its hash."""

    def __init__(self, root: Path) -> None:
        self.root = root

    def has(self, entry: Entry) -> bool:
        """Whether such a file is here, by its name and size."""
        try:
            return (self.root / entry.sha256).stat().st_size == entry.size
        except FileNotFoundError:
            return False

    def link(self, entries: Sequence[Entry], folder: Path, alive: Callable[[], None]) -> None:
        """Have files that are here below a folder, too, hashed again. One that is not as it was is
        deleted here. `alive` is called, from any thread, while they are read.

        Raises `InstallFailed` (STORE_DAMAGED, …).
        """
        for entry in entries:
            target = folder / entry.path
            target.parent.mkdir(parents=True, exist_ok=True)
            try:
                os.utime(self.root / entry.sha256)
                os.link(self.root / entry.sha256, target)
            except OSError as error:
                raise disk.failed(error, f"{entry.path} cannot be linked", self.root) from error
        files = [StoredFile(entry.path, entry.size, entry.sha256) for entry in entries]
        damaged = checking.damaged(folder, files, alive)
        for file in damaged:  # so that it is copied the next time
            self.remove(file.sha256)
        if damaged:
            raise InstallFailed(*(_damaged(file.path, self.root) for file in damaged))

    def keep(self, path: Path, sha256: str) -> None:
        """Take a file in whose bytes have that hash, and have it on disk.

        Raises `InstallFailed`.
        """
        try:
            path.chmod(0o444)  # the worker that reads it may be any user
            disk.sync(path)
            if not (self.root / sha256).exists():
                disk.make_folder(self.root)
                os.link(path, self.root / sha256)
                disk.sync(self.root)
        except OSError as error:
            raise disk.failed(error, f"{path.name} cannot be stored", self.root) from error

    def kept(self) -> Iterator[Kept]:
        """All that is here."""
        for path in sorted(self.root.iterdir()) if self.root.is_dir() else ():
            found = path.stat()
            yield Kept(path.name, found.st_size, found.st_mtime)

    def remove(self, sha256: str) -> None:
        """Delete a file; the payload that has it keeps it."""
        (self.root / sha256).unlink(missing_ok=True)


def _damaged(path: str, where: Path) -> Problem:
    return Problem(
        "STORE_DAMAGED",
        f"{path} in the store is not what was stored",
        where=str(where),
        fix="pull the payload and plug it in again",
    )

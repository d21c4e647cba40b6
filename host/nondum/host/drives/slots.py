"""Slots: folders whose entries, real folders or symlinks, stand for drives.

Put an entry there by rename or as a symlink, so that it is whole the moment it appears.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path

from nondum.host.events import DriveInserted, DriveRemoved, DrivesScanned, Emit
from nondum.host.inotify import folders_watched

_Identity = tuple[Path, int, str]
"""Path, inode and symlink target: an entry that is replaced is another drive."""


class SlotSource:
    """Watches slot folders; folders that are not there are made."""

    kind = "slot"

    def __init__(self, folders: Sequence[Path]) -> None:
        self._folders = tuple(folders)
        self._seen: dict[str, _Identity] = {}

    async def watch(self, emit: Emit) -> None:
        """Tell what is there, then what comes and goes, until cancelled."""
        with folders_watched(self._folders) as changed:
            self._compare(emit)
            emit(DrivesScanned(self.kind, tuple(self._seen)))
            while True:
                await changed.wait()
                changed.clear()
                self._compare(emit)

    def _compare(self, emit: Emit) -> None:
        """Tell the difference to what was seen last."""
        present = dict(self._entries())
        for drive, identity in list(self._seen.items()):
            if present.get(drive) != identity:
                del self._seen[drive]
                emit(DriveRemoved(drive))
        for drive, identity in present.items():
            if drive not in self._seen:
                self._seen[drive] = identity
                emit(DriveInserted(drive, identity[0], self.kind))

    def _entries(self) -> Iterator[tuple[str, _Identity]]:
        for folder in self._folders:
            for entry in sorted(os.scandir(folder), key=lambda entry: entry.name):
                if entry.name.startswith(".") or not entry.is_dir():
                    continue
                name = entry.name if len(self._folders) == 1 else f"{folder.name}/{entry.name}"
                target = str(Path(entry.path).readlink()) if entry.is_symlink() else ""
                yield name, (Path(entry.path), entry.inode(), target)

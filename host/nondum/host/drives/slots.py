"""Slots: folders whose entries, real folders or symlinks, stand for drives (inotify(7)).

Put an entry there by rename or as a symlink, so that it is whole the moment it appears.
"""

from __future__ import annotations

import asyncio
import ctypes
import os
from collections.abc import Iterator, Sequence
from pathlib import Path

from nondum.host.events import DriveInserted, DriveRemoved, DrivesScanned, Emit

IN_MOVED_FROM = 0x40
IN_MOVED_TO = 0x80
IN_CREATE = 0x100
IN_DELETE = 0x200
_WATCHED = IN_MOVED_FROM | IN_MOVED_TO | IN_CREATE | IN_DELETE
_BUFFER = 64 * 1024

_libc = ctypes.CDLL(None, use_errno=True)

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
        loop = asyncio.get_running_loop()
        changed = asyncio.Event()
        descriptor = self._open()
        try:
            loop.add_reader(descriptor, _drain, descriptor, changed)
            self._compare(emit)
            emit(DrivesScanned(self.kind, tuple(self._seen)))
            while True:
                await changed.wait()
                changed.clear()
                self._compare(emit)
        finally:
            loop.remove_reader(descriptor)
            os.close(descriptor)

    def _open(self) -> int:
        descriptor = _libc.inotify_init1(os.O_NONBLOCK | os.O_CLOEXEC)
        if descriptor < 0:
            raise _error("inotify_init1")
        for folder in self._folders:
            folder.mkdir(parents=True, exist_ok=True)
            if _libc.inotify_add_watch(descriptor, os.fsencode(folder), _WATCHED) < 0:
                os.close(descriptor)
                raise _error(str(folder))
        return int(descriptor)

    def _compare(self, emit: Emit) -> None:
        """Tell the difference to what was seen last; no event can be missed for good this way."""
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


def _drain(descriptor: int, changed: asyncio.Event) -> None:
    try:
        while os.read(descriptor, _BUFFER):
            changed.set()
    except BlockingIOError:
        pass


def _error(what: str) -> OSError:
    code = ctypes.get_errno()
    return OSError(code, os.strerror(code), what)

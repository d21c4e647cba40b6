"""Folders that are watched for changes of their entries, on the loop (inotify(7))."""

from __future__ import annotations

import asyncio
import ctypes
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

IN_CLOSE_WRITE = 0x8
IN_MOVED_FROM = 0x40
IN_MOVED_TO = 0x80
IN_CREATE = 0x100
IN_DELETE = 0x200
WATCHED = IN_CLOSE_WRITE | IN_MOVED_FROM | IN_MOVED_TO | IN_CREATE | IN_DELETE
"""From linux/inotify.h: an entry came, went, or has been written."""
CAME = IN_MOVED_TO | IN_CREATE
"""An entry came."""
WENT_ITSELF = 0x400 | 0x800
"""IN_DELETE_SELF, IN_MOVE_SELF: the folder is gone from where it was."""
NOT_BY_A_LINK = 0x02000000
"""IN_DONT_FOLLOW: what is watched is no link."""
_ADDED = 0x20000000
"""IN_MASK_ADD: what is watched already is watched for this, too."""
_BUFFER = 64 * 1024


class Watches:
    """An instance of inotify that sets an event whenever something has changed. Make and close it
    on the loop."""

    def __init__(self, changed: asyncio.Event) -> None:
        """Raises `OSError`, for example where a user may have no more instances."""
        self._libc = ctypes.CDLL(None, use_errno=True)
        self._descriptor = self._libc.inotify_init1(os.O_NONBLOCK | os.O_CLOEXEC)
        if self._descriptor < 0:
            raise _error("inotify")
        self._loop = asyncio.get_running_loop()
        self._loop.add_reader(self._descriptor, _drain, self._descriptor, changed)

    def add(self, path: Path, what: int = WATCHED) -> None:
        """Watch a path, too; from any thread. Raises `OSError`."""
        added = what | _ADDED
        if self._libc.inotify_add_watch(self._descriptor, os.fsencode(path), added) < 0:
            raise _error(str(path))

    def close(self) -> None:
        """Watch no more."""
        self._loop.remove_reader(self._descriptor)
        os.close(self._descriptor)


@contextmanager
def folders_watched(folders: Sequence[Path]) -> Iterator[asyncio.Event]:
    """Watch folders for as long as the context lasts; those that are not there are made.

    Gives an event that is set whenever something has changed; clear it, then look: nothing is
    missed for good this way. Raises `OSError`, for example where a user may watch no more.
    """
    changed = asyncio.Event()
    watches = Watches(changed)
    try:
        for folder in folders:
            folder.mkdir(parents=True, exist_ok=True)
            watches.add(folder)
        yield changed
    finally:
        watches.close()


def _drain(descriptor: int, changed: asyncio.Event) -> None:
    changed.set()
    try:
        while os.read(descriptor, _BUFFER):
            pass
    except BlockingIOError:
        pass


def _error(what: str) -> OSError:
    code = ctypes.get_errno()
    return OSError(code, os.strerror(code), what)

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
_BUFFER = 64 * 1024


@contextmanager
def folders_watched(folders: Sequence[Path]) -> Iterator[asyncio.Event]:
    """Watch folders for as long as the context lasts; those that are not there are made.

    Gives an event that is set whenever something has changed; clear it, then look: nothing is
    missed for good this way. Raises `OSError`, for example where a user may watch no more.
    """
    libc = ctypes.CDLL(None, use_errno=True)
    descriptor = libc.inotify_init1(os.O_NONBLOCK | os.O_CLOEXEC)
    if descriptor < 0:
        raise _error("inotify")
    changed = asyncio.Event()
    loop = asyncio.get_running_loop()
    try:
        for folder in folders:
            folder.mkdir(parents=True, exist_ok=True)
            if libc.inotify_add_watch(descriptor, os.fsencode(folder), WATCHED) < 0:
                raise _error(str(folder))
        loop.add_reader(descriptor, _drain, descriptor, changed)
        yield changed
    finally:
        loop.remove_reader(descriptor)
        os.close(descriptor)


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

"""Stored files hashed again, as fast as their bytes can be: this is most of a warm installation."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from nondum.wheelhouse.store import disk
from nondum.wheelhouse.store.unpacking import THREADS, StoredFile

_LARGE = 256 * 1024
"""Files from this size on are worth a thread; also how much of them is read at once."""


def damaged(
    root: Path, files: Sequence[StoredFile], alive: Callable[[], None] = lambda: None
) -> tuple[StoredFile, ...]:
    """Those of the files under `root` that are not as they were, or not there.

    `alive` is called, from any thread, whenever a piece of a large one has been read. Raises what
    it raises, and `OSError` where this process has no descriptor or no memory left.
    """
    large = [file for file in files if file.size >= _LARGE]
    small = [file for file in files if file.size < _LARGE]
    with ThreadPoolExecutor(THREADS) as pool:
        large.sort(key=lambda file: -file.size)
        whole = pool.map(lambda file: _is_whole(f"{root}/{file.path}", file, alive), large)
        found = [file for file in small if not _is_whole(f"{root}/{file.path}", file, alive)]
        pairs = zip(large, whole, strict=True)
        return (*(file for file, is_whole in pairs if not is_whole), *found)


class _DamagedError(Exception):
    """The file is not there, has another size, or cannot be read."""


def _is_whole(path: str, file: StoredFile, alive: Callable[[], None]) -> bool:
    digest = hashlib.sha256()
    try:
        for piece in _read(path, file.size):
            digest.update(piece)
            if file.size > _LARGE:
                alive()  # what it raises says nothing about the file
    except _DamagedError:
        return False
    return digest.hexdigest() == file.sha256


def _read(path: str, size: int) -> Iterator[memoryview]:
    buffer = memoryview(bytearray(min(size, _LARGE)))
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NOFOLLOW)
        try:
            if os.fstat(descriptor).st_size != size:
                raise _DamagedError
            while count := os.readv(descriptor, [buffer]):
                yield buffer[:count]
        finally:
            os.close(descriptor)
    except OSError as error:
        if disk.is_shortage(error):
            raise
        raise _DamagedError from error

"""Stored files hashed again, as fast as their bytes can be: this is most of a warm installation."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from nondum.wheelhouse.unpacking import THREADS, StoredFile

_LARGE = 256 * 1024
"""Files from this size on are worth a thread; also how much of them is read at once."""


def damaged(
    root: Path, files: Sequence[StoredFile], alive: Callable[[], None] = lambda: None
) -> tuple[StoredFile, ...]:
    """Those of the files under `root` that are not as they were, or not there.

    `alive` is called, from any thread, whenever a piece of a large one has been read.
    """
    large = [file for file in files if file.size >= _LARGE]
    small = [file for file in files if file.size < _LARGE]
    with ThreadPoolExecutor(THREADS) as pool:
        large.sort(key=lambda file: -file.size)
        whole = pool.map(lambda file: _is_whole(f"{root}/{file.path}", file, alive), large)
        found = [file for file in small if not _is_whole(f"{root}/{file.path}", file, alive)]
        pairs = zip(large, whole, strict=True)
        return (*(file for file, is_whole in pairs if not is_whole), *found)


def _is_whole(path: str, file: StoredFile, alive: Callable[[], None]) -> bool:
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NOFOLLOW)
    except OSError:
        return False
    try:
        if os.fstat(descriptor).st_size != file.size:
            return False
        return _digest(descriptor, file.size, alive) == file.sha256
    except OSError:
        return False
    finally:
        os.close(descriptor)


def _digest(descriptor: int, size: int, alive: Callable[[], None]) -> str:
    digest = hashlib.sha256()
    buffer = memoryview(bytearray(min(size, _LARGE)))
    while count := os.readv(descriptor, [buffer]):
        digest.update(buffer[:count])
        if size > _LARGE:
            alive()
    return digest.hexdigest()

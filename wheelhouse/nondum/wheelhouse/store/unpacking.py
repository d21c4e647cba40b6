"""Wheels become files: several at once, each file hashed as it is written, the largest first.

Inflating, hashing and writing let other threads run, so that all processors have something to do
until the end; one library in one file is what takes longest.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path

from nondum.sdk.errors import PayloadRefused, Problem
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.format.fixed_file import Bytes, FixedFile
from nondum.wheelhouse.wheels import archive, wheel
from nondum.wheelhouse.wheels.wheel import Layout, PlannedFile

THREADS = max(2, min(8, os.cpu_count() or 2))

_WRITE_SOON = 1024 * 1024
"""Files from this size on are sent to the disk at once, while others are still being inflated."""
_HASHED_AT_ONCE = 1024 * 1024
"""Bytes: each time, a thread has to wait for others."""
_SYNC_FILE_RANGE_WRITE = 2
_libc = ctypes.CDLL(None, use_errno=True)


Progress = Callable[[int, int], None]
"""Bytes written, bytes to write, also again where none was written but a wheel was read on. Called
from any thread, one at a time."""


@frozen
class StoredFile:
    """One file of a stored wheel."""

    path: str
    size: int
    sha256: str


@frozen
class Source:
    """A wheel to be unpacked, and the empty or absent folder for its files."""

    path: Path
    sha256: str
    root: Path


@frozen
class Unpacked:
    """What was written of a wheel."""

    files: tuple[StoredFile, ...]
    """By path."""
    left_out: tuple[str, ...]


def unpack(sources: Sequence[Source], progress: Progress | None = None) -> tuple[Unpacked, ...]:
    """Unpack wheels whose files no other process can change. Nothing is synced.

    Raises `PayloadRefused` (HASH_MISMATCH, WHEEL_…) and `OSError`; what was written by then is
    left to the caller.
    """
    with ExitStack() as opened, ThreadPoolExecutor(THREADS) as pool:
        try:
            views = [opened.enter_context(wheel.opened(source.path)) for source in sources]
            counter = _Counter(progress)
            hashes = [pool.submit(_hash, view, counter) for view in views]
            layouts = [_laid_out(view, s) for view, s in zip(views, sources, strict=True)]
            return _unpacked(pool, sources, views, layouts, hashes, counter)
        finally:
            pool.shutdown(cancel_futures=True)


def _unpacked(
    pool: ThreadPoolExecutor,
    sources: Sequence[Source],
    views: Sequence[FixedFile],
    layouts: Sequence[Layout],
    hashes: Sequence[Future[str]],
    counter: _Counter,
) -> tuple[Unpacked, ...]:
    planned = [
        (file, source, view)
        for source, view, layout in zip(sources, views, layouts, strict=True)
        for file in layout.files
    ]
    planned.sort(key=lambda one: -one[0].size)
    counter.begin(sum(file.size for file, _, _ in planned))
    written = [(one[1], pool.submit(_write, *one, counter)) for one in planned]
    for source, digest in zip(sources, hashes, strict=True):
        if digest.result() != source.sha256:
            text = "is not the wheel that was locked"
            raise PayloadRefused(Problem("HASH_MISMATCH", text, where=source.path.name))
    files: dict[Source, list[StoredFile]] = {source: [] for source in sources}
    problems = []
    for source, future in written:
        result = future.result()
        if isinstance(result, Problem):
            problems.append(result)
        else:
            files[source].append(result)
    wheel.refuse_if_any(tuple(problems))
    return tuple(
        Unpacked(tuple(sorted(files[source], key=lambda file: file.path)), layout.left_out)
        for source, layout in zip(sources, layouts, strict=True)
    )


def _hash(data: FixedFile, counter: _Counter) -> str:
    digest, at = hashlib.sha256(), 0
    buffer = memoryview(bytearray(min(len(data), _HASHED_AT_ONCE)))
    while count := data.read_into(buffer, at):
        digest.update(buffer[:count])
        at += count
        counter.add(0)  # a large wheel takes minutes on a slow disk
    return digest.hexdigest()


def _laid_out(data: Bytes, source: Source) -> Layout:
    """The layout of a sound wheel, its folders made."""
    layout = wheel.lay_out(data, source.path.name)
    wheel.refuse_if_any(layout.problems)
    for parent in sorted({os.path.dirname(file.target) for file in layout.files}):  # noqa: PTH120
        (source.root / parent).mkdir(parents=True, exist_ok=True)
    return layout


class _Counter:
    """Adds up what all threads have written."""

    def __init__(self, progress: Progress | None) -> None:
        self._progress = progress
        self._lock = threading.Lock()
        self._done, self._total = 0, -1

    def begin(self, total: int) -> None:
        """Know how much is to be written: from now on progress is told."""
        with self._lock:
            self._total = total

    def add(self, size: int) -> None:
        """Count `size` bytes, perhaps 0, and report the progress."""
        if self._progress is None:
            return
        with self._lock:
            self._done += size
            if self._total >= 0:
                self._progress(self._done, self._total)


def _write(
    file: PlannedFile, source: Source, data: Bytes, counter: _Counter
) -> StoredFile | Problem:
    digest = hashlib.sha256()
    pieces = archive.unpack(data, file.member) if file.contents is None else (file.contents,)
    try:
        # Buffered: a raw file on a full disk writes less than it was given, and does not raise.
        with open(f"{source.root}/{file.target}", "xb") as out:  # noqa: PTH123  # many files
            for piece in pieces:
                digest.update(piece)
                out.write(piece)
                counter.add(len(piece))
            out.flush()
            os.fchmod(out.fileno(), 0o555 if file.member.is_executable else 0o444)
            if file.size >= _WRITE_SOON:
                _libc.sync_file_range(out.fileno(), 0, 0, _SYNC_FILE_RANGE_WRITE)
    except ValueError as error:
        return wheel.damaged(file, source.path.name, str(error))
    if file.sha256 and digest.hexdigest() != file.sha256:
        return wheel.damaged(file, source.path.name, "it is not what RECORD says")
    return StoredFile(file.target, file.size, digest.hexdigest())

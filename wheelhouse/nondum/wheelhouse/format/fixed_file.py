"""A file whose bytes never change, read by position (pread(2)) instead of being mapped.

A mapping takes address space for as long as it is there, as much as the file is long: a process
that is held to 2 GiB of it could not open several large wheels, nor a larger one.
"""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Protocol, Self

PIECE = 128 * 1024
"""Bytes that are read at once where all of them are: more do not stay in a processor's cache."""


class Bytes(Protocol):
    """Bytes that are cut out by slices: of a `memoryview`, or of a `FixedFile`."""

    def __len__(self) -> int:
        """How many there are."""

    def __getitem__(self, span: slice, /) -> bytes | memoryview:
        """Some of them: fewer where the slice goes beyond the end."""


class FixedFile:
    """The file at a path, open until it is closed. Any thread may read it."""

    def __init__(self, path: Path) -> None:
        """Raises `OSError`."""
        self._path = path
        self._descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
        self._size = os.fstat(self._descriptor).st_size

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file; it can be read no more."""
        os.close(self._descriptor)

    def __len__(self) -> int:
        return self._size

    def __getitem__(self, span: slice, /) -> bytes:
        """Bytes from one position to another, read now. Raises `OSError`, also when the file has
        become shorter."""
        start, stop, _ = span.indices(self._size)
        wanted = max(0, stop - start)
        found = os.pread(self._descriptor, wanted, start)
        while len(found) < wanted:  # a read takes less than 2 GiB (read(2))
            more = os.pread(self._descriptor, wanted - len(found), start + len(found))
            if not more:
                raise OSError(errno.EIO, "the file has become shorter", str(self._path))
            found += more
        return found

    def read_into(self, buffer: memoryview, at: int) -> int:
        """Fill a buffer with the bytes from a position on; how many it was, 0 at the end.

        Raises `OSError`.
        """
        return os.preadv(self._descriptor, [buffer], at)


def pieces(data: Bytes, start: int, end: int, size: int = PIECE) -> Iterator[bytes | memoryview]:
    """The bytes between two positions, in pieces.

    >>> [bytes(piece) for piece in pieces(memoryview(b"abcdefgh"), 1, 6, size=2)]
    [b'bc', b'de', b'f']
    """
    for at in range(start, end, size):
        yield data[at : min(end, at + size)]

"""How fast the disk is on which a host keeps its state: what payloads and commits wait for."""

from __future__ import annotations

import os
import statistics
import tempfile
import time
from pathlib import Path

from nondum.sdk.frozen import frozen

_PIECE = 1 << 20
_PIECES = 32
_COMMITS = 20
_COMMIT_BYTES = 4096


@frozen
class DiskSpeed:
    """What was measured, by a file of 32 MiB that is removed again."""

    write_mb_s: float
    """In one go, until all of it is on the disk."""
    read_mb_s: float
    """In one go, not from memory; where the file system keeps it there all the same, from it."""
    commit_ms: float
    """The median of 20: four KiB more, until they are on the disk."""

    def __str__(self) -> str:
        return (
            f"writes {self.write_mb_s:.0f} MB/s, reads {self.read_mb_s:.0f} MB/s, "
            f"a commit of 4 KiB takes {self.commit_ms:.1f} ms"
        )


def measure(folder: Path) -> DiskSpeed:
    """Measure, in a folder; takes seconds. Raises `OSError`."""
    with tempfile.TemporaryFile(dir=folder, prefix=".nondum-board-") as file:
        descriptor = file.fileno()
        pieces = [os.urandom(_PIECE) for _ in range(_PIECES)]
        begun_s = time.monotonic()
        for piece in pieces:
            os.write(descriptor, piece)
        os.fsync(descriptor)
        written_s = time.monotonic() - begun_s
        os.posix_fadvise(descriptor, 0, 0, os.POSIX_FADV_DONTNEED)
        begun_s = time.monotonic()
        for number in range(_PIECES):
            os.pread(descriptor, _PIECE, number * _PIECE)
        read_s = time.monotonic() - begun_s
        commits_s = [_commit(descriptor) for _ in range(_COMMITS)]
    megabytes = _PIECE * _PIECES / 1e6
    commit_ms = statistics.median(commits_s) * 1000
    return DiskSpeed(megabytes / written_s, megabytes / read_s, commit_ms)


def _commit(descriptor: int) -> float:
    begun_s = time.monotonic()
    os.write(descriptor, os.urandom(_COMMIT_BYTES))
    os.fsync(descriptor)
    return time.monotonic() - begun_s

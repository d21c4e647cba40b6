"""Disk that is set aside for the catalogue, so that it can be written when all else is full."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

from nondum.sdk.frozen import frozen

RESERVE_BYTES = 8 * 1024**2
"""More than SQLite's log grows to between two checkpoints."""
SPARE_BYTES = 4 * RESERVE_BYTES
"""So much must be free beside it before it is taken again."""


@frozen
class Reserve:
    """A file that takes disk space until the catalogue needs it."""

    path: Path

    def take(self) -> bool:
        """Take the space, unless it is taken or the disk has too little; whether it is taken."""
        if self.is_taken:
            return True
        try:
            disk = os.statvfs(self.path.parent)
            if disk.f_bavail * disk.f_frsize < RESERVE_BYTES + SPARE_BYTES:
                return False
            descriptor = os.open(self.path, os.O_CREAT | os.O_WRONLY | os.O_CLOEXEC, 0o600)
            try:
                os.posix_fallocate(descriptor, 0, RESERVE_BYTES)
            finally:
                os.close(descriptor)
        except OSError:
            self.release()
            return False
        return True

    def release(self) -> bool:
        """Free the space for what must be written now; whether there was any."""
        was_taken = self.is_taken
        with contextlib.suppress(OSError):
            self.path.unlink(missing_ok=True)
        return was_taken

    @property
    def is_taken(self) -> bool:
        """Whether the space is taken."""
        try:
            return self.path.stat().st_size >= RESERVE_BYTES
        except OSError:
            return False

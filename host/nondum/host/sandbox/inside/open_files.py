"""What processes have open, read from /proc (proc(5)) by a process that may look into them."""

from __future__ import annotations

import contextlib
import os
import stat
from collections.abc import Collection, Iterator
from pathlib import Path

BLOCK = 512
"""st_blocks, in bytes (stat(3type))."""


def most(pids: Collection[int]) -> int:
    """Open files of that process which has most, as far as they may be counted: those of another
    user are told from Linux 6.2 on."""
    return max((count for pid in pids for count in _open(pid)), default=0)


def deleted_sizes(folder: str, pids: Collection[int]) -> Iterator[int]:
    """Bytes on the disk of each file that these processes hold open, on the file system of a
    folder, after it was deleted."""
    try:
        device = os.stat(folder).st_dev  # noqa: PTH116
    except OSError:
        return
    seen: set[int] = set()
    for pid in pids:
        with contextlib.suppress(OSError):
            for link in Path(f"/proc/{pid}/fd").iterdir():
                with contextlib.suppress(OSError):
                    found = link.stat()
                    is_file = stat.S_ISREG(found.st_mode) and found.st_dev == device
                    if is_file and not found.st_nlink and found.st_ino not in seen:
                        seen.add(found.st_ino)
                        yield found.st_blocks * BLOCK


def _open(pid: int) -> Iterator[int]:
    folder = Path(f"/proc/{pid}/fd")
    with contextlib.suppress(OSError):  # it has ended, or may not be looked at
        yield folder.stat().st_size or sum(1 for _ in folder.iterdir())

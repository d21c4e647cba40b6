"""Memory that processes hold, as the kernel tells it (proc_pid_smaps(5), proc_pid_fd(5)).

To read that takes some milliseconds a process: not for the loop.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Collection, Iterator
from pathlib import Path

from nondum.host.sandbox.inside.open_files import BLOCK

KILOBYTE = 1024
_PAGE_BYTES = os.sysconf("SC_PAGE_SIZE")


def private_bytes(pids: Collection[int]) -> int:
    """What they have for themselves alone: what is free once they are gone."""
    return sum(_rolled_up(pid, ("Private_",)) for pid in pids)


def held_bytes(pids: Collection[int]) -> int:
    """What they hold that is no file's on a disk, with their share of what they share: private
    pages, shared memory, and files in memory (memfd) whether they are mapped or not.

    Of processes that may not be looked into, private pages alone.
    """
    private = sum(_rolled_up(pid, ("Pss_Anon",)) for pid in pids)
    shared = sum(_rolled_up(pid, ("Pss_Shmem",), hidden=0) for pid in pids)
    return private + max(shared, sum(dict(_files_in_memory(pids)).values()))


def family(first: int) -> tuple[int, ...]:
    """A process and all that descend from it, but for those whose parents have ended."""
    found = [first]
    for pid in found:
        with contextlib.suppress(OSError):  # it has ended
            for children in Path(f"/proc/{pid}/task").glob("*/children"):
                found += map(int, children.read_text(encoding="ascii").split())
    return tuple(found)


def _rolled_up(pid: int, kinds: tuple[str, ...], hidden: int | None = None) -> int:
    """The sum of these lines; of another user's process `hidden`, or what all may know."""
    try:
        lines = Path(f"/proc/{pid}/smaps_rollup").read_text(encoding="ascii").splitlines()
    except PermissionError:
        return _resident_bytes(pid) if hidden is None else hidden
    except OSError:  # it has just ended
        return 0
    return sum(int(line.split()[1]) for line in lines if line.startswith(kinds)) * KILOBYTE


def _resident_bytes(pid: int) -> int:
    """Pages in memory that are no file's (proc_pid_statm(5))."""
    try:
        resident, shared = Path(f"/proc/{pid}/statm").read_text(encoding="ascii").split()[1:3]
    except OSError:
        return 0
    return (int(resident) - int(shared)) * _PAGE_BYTES


def _files_in_memory(pids: Collection[int]) -> Iterator[tuple[int, int]]:
    """Inode and bytes of each memfd that is open."""
    for pid in pids:
        with contextlib.suppress(OSError):
            for link in Path(f"/proc/{pid}/fd").iterdir():
                with contextlib.suppress(OSError):
                    if str(link.readlink()).startswith("/memfd:"):
                        found = link.stat()
                        yield found.st_ino, found.st_blocks * BLOCK

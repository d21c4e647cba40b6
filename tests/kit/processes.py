"""Processes, whosever children they are: whether they run, and their end."""

from __future__ import annotations

import asyncio
import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

from tests.kit.until import PATIENCE_S, arrived


def is_alive(pid: int) -> bool:
    """Whether a process exists and is no zombie."""
    try:
        status = Path(f"/proc/{pid}/stat").read_text(encoding="ascii")
    except OSError:
        return False
    return status.rpartition(")")[2].split()[0] not in {"Z", "X"}


def children() -> frozenset[int]:
    """The processes that this one started and has not reaped."""
    told: set[int] = set()
    for task in Path("/proc/self/task").iterdir():
        with contextlib.suppress(OSError):  # a thread that ends: its children are another's then
            told.update(map(int, (task / "children").read_text(encoding="ascii").split()))
    return frozenset(told)


@contextlib.contextmanager
def process_ended(pid: int) -> Iterator[asyncio.Event]:
    """Set when a process ends (pidfd_open(2))."""
    ended, descriptor = asyncio.Event(), os.pidfd_open(pid)
    loop = asyncio.get_running_loop()

    def see_end() -> None:
        loop.remove_reader(descriptor)  # it stays readable
        ended.set()

    loop.add_reader(descriptor, see_end)
    try:
        yield ended
    finally:
        loop.remove_reader(descriptor)
        os.close(descriptor)


async def until_gone(pid: int, timeout_s: float = PATIENCE_S) -> None:
    """Wait for a process to end, or return at once if there is none."""
    with contextlib.suppress(ProcessLookupError), process_ended(pid) as ended:
        await arrived(f"end of process {pid}", ended.wait(), patience_s=timeout_s)

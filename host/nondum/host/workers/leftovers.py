"""Finds what workers leave behind: processes that went out of their group, or outlived a daemon.

Every worker's environment names its scratch folder, and what it starts inherits that
(proc_pid_environ(5)). A process that clears its environment escapes; holding such ones takes a
confinement of a higher level.
"""

from __future__ import annotations

import contextlib
import os
import signal
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from nondum.host.sandbox.cgroups import Cgroup
from nondum.host.workers.launcher import MARK, owner_mark
from nondum.host.workers.spare import OWNER

ROUNDS = 5
"""Searches at most: a process may fork while it is being found."""


def end_leftovers(folder: Path) -> int:
    """SIGKILL every process of a worker whose scratch folder is `folder` or below it.

    Likewise what an earlier daemon with its scratch folders there had started to become a worker.
    Blocks for some milliseconds; returns how many were found.
    """
    ended: set[int] = set()
    for _ in range(ROUNDS):
        found = set(_end_marked(folder))
        ended |= found
        if not found:
            break
    return len(ended)


def ends_of_all(cgroup: Cgroup | None, folder: Path) -> list[Callable[[], object]]:
    """What ends all that the process of a worker has started, if its scratch folder is `folder`;
    each may block, and raise `OSError`."""
    by_cgroup = [] if cgroup is None else [cgroup.end]
    return [*by_cgroup, partial(end_leftovers, folder)]


def clear_away(*steps: Callable[[], object]) -> None:
    """Take all these steps in their order, whichever of them fails; the last failure is raised."""
    with contextlib.ExitStack() as left:
        for step in reversed(steps):
            left.callback(step)


def marked(folder: Path) -> Iterator[int]:
    """Every process of a worker whose scratch folder is `folder`, if it has kept its environment.

    Blocks for some milliseconds.
    """
    return (pid for pid in _every() if _is_marked(pid, folder))


def _every() -> list[int]:
    return [int(entry.name) for entry in Path("/proc").iterdir() if entry.name.isdigit()]


def _end_marked(folder: Path) -> Iterator[int]:
    for pid in _every():
        with contextlib.suppress(OSError):
            # Taken before the look, so that what is ended is what was seen.
            descriptor = os.pidfd_open(pid)
            try:
                if _is_marked(pid, folder):
                    signal.pidfd_send_signal(descriptor, signal.SIGKILL)
                    yield pid
            finally:
                os.close(descriptor)


def _is_marked(pid: int, folder: Path) -> bool:
    try:
        variables = Path(f"/proc/{pid}/environ").read_bytes().split(b"\0")
    except OSError:  # not ours to look at, or it has just ended
        return False
    mark, own = f"{MARK}={folder}".encode(), f"{OWNER}={owner_mark(folder)}".encode()
    spares = own[: own.rindex(b":") + 1]
    return any(
        v == mark or v.startswith(mark + b"/") or (v.startswith(spares) and v != own)
        for v in variables
    )

"""Resource limits of a worker's process (setrlimit(2))."""

from __future__ import annotations

import os
import resource
from collections.abc import Mapping

MEGABYTE = 1024 * 1024


def limit(limits: Mapping[str, int | None]) -> None:
    """Set hard limits; what the system limits more stays so."""
    wanted = {
        # Not RLIMIT_AS: numeric and graphics libraries reserve far more than they use.
        resource.RLIMIT_DATA: _bytes(limits["memory_mb"]),
        resource.RLIMIT_NOFILE: limits["descriptors"],
        resource.RLIMIT_FSIZE: _bytes(limits["file_mb"]),
        resource.RLIMIT_CORE: _bytes(limits["core_mb"]),
        resource.RLIMIT_CPU: limits["cpu_s"],
    }
    tasks = limits["tasks"]
    if tasks is not None and os.getuid() != 0:  # all of the user's count, and root is not bound
        wanted[resource.RLIMIT_NPROC] = tasks_of(os.getuid()) + tasks
    for kind, value in wanted.items():
        if value is not None:
            _, hard = resource.getrlimit(kind)
            bounded = value if hard == resource.RLIM_INFINITY else min(value, hard)
            resource.setrlimit(kind, (bounded, bounded))


def tasks_of(uid: int) -> int:
    """How many processes and threads a user has now."""
    count = 0
    with os.scandir("/proc") as entries:
        for entry in entries:
            try:
                if entry.name.isdigit() and entry.stat().st_uid == uid:
                    count += os.stat(f"{entry.path}/task").st_nlink - 2  # noqa: PTH116  # pathlib: 3 ms
            except OSError:  # it has just ended
                continue
    return count


def _bytes(megabytes: int | None) -> int | None:
    return None if megabytes is None else megabytes * MEGABYTE

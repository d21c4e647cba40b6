"""Which processes there are, and which come from which. Loads nothing of the project."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path


def descendants(pid: int) -> set[int]:
    """Processes that one has started, and that those have started; zombies are none."""
    parents: dict[int, int] = {}
    for other in pids():
        with contextlib.suppress(OSError):
            fields = Path(f"/proc/{other}/stat").read_text().rpartition(")")[2].split()
            parents[other] = 0 if fields[0] == "Z" else int(fields[1])
    below = {pid}
    while more := {child for child, parent in parents.items() if parent in below} - below:
        below |= more
    return below - {pid}


def pids() -> Iterator[int]:
    """All processes."""
    return (int(entry.name) for entry in Path("/proc").iterdir() if entry.name.isdigit())

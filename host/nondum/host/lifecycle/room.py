"""Whether two releases of a payload can run side by side: memory, and what its manifest says."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

RESERVE_MB = 64
"""Memory that is left free while two releases run."""


@dataclass(frozen=True, slots=True)
class Needs:
    """What a payload's manifest says of the room that it takes."""

    memory_mb: int = 0
    alone: bool = False
    """Whether no other release of it may run beside it."""

    @classmethod
    def parse(cls, said: Mapping[str, Any]) -> Needs:
        """Read what the job `install` told. It comes from our own child and is trusted."""
        return cls(memory_mb=said["memory_mb"], alone=said["alone"])


def why_not_beside(needs: Needs, used_mb: int, free_mb: int) -> str:
    """Why a release cannot run beside another one, of which the workers use so much memory.

    >>> why_not_beside(Needs(memory_mb=100), used_mb=300, free_mb=1000)
    ''
    >>> why_not_beside(Needs(memory_mb=100), used_mb=300, free_mb=200)
    'there is no memory for two at once: 364 MB are needed, 200 MB are free'
    """
    if needs.alone:
        return "its manifest says that it runs alone"
    needed_mb = max(needs.memory_mb, used_mb) + RESERVE_MB
    if needed_mb > free_mb:
        return (
            f"there is no memory for two at once: {needed_mb} MB are needed, {free_mb} MB are free"
        )
    return ""


def used_mb(pids: Collection[int]) -> int:
    """Memory that processes have for themselves alone: what is free once they are gone.

    Blocks for some milliseconds (proc_pid_smaps(5)).
    """
    return sum(map(_private_kb, pids)) // 1024


def _private_kb(pid: int) -> int:
    try:
        lines = Path(f"/proc/{pid}/smaps_rollup").read_text(encoding="ascii").splitlines()
    except OSError:  # it has just ended
        return 0
    return sum(int(line.split()[1]) for line in lines if line.startswith("Private_"))

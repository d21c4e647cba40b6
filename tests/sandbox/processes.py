"""Processes of this machine."""

from __future__ import annotations

from pathlib import Path


def children(pid: int) -> set[int]:
    listed = Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="ascii")
    return set(map(int, listed.split()))

"""Whether two releases of a payload can run side by side: memory, and what its manifest says."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

from nondum.host.workers.held_memory import private_bytes
from nondum.sdk.codec.values import from_plain
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.payload.memory import Memory

RESERVE_MB = 64
"""Memory that is left free while two releases run."""


@frozen
class Needs:
    """The memory that a payload needs, as its manifest says."""

    payload_id: str = ""
    memory_mb: int = 0
    gpu_memory_mb: int = 0
    alone: bool = False
    """Whether no other release of it may run beside it."""

    @classmethod
    def parse(cls, said: Mapping[str, Any]) -> Needs:
        """Read what the job `install` told. It comes from our own child and is trusted."""
        return from_plain(cls, said)


def why_not_beside(needs: Needs, used_mb: int, have: Memory) -> str:
    """Why a release cannot run beside another one, of which the workers use so much memory.

    >>> why_not_beside(Needs(memory_mb=100), used_mb=300, have=Memory(1000))
    ''
    >>> why_not_beside(Needs(memory_mb=100), used_mb=300, have=Memory(200))
    'there is no memory for two at once: 364 MB are needed, 200 MB are left'
    """
    if needs.alone:
        return "its manifest says that it runs alone"
    needed_mb = max(needs.memory_mb, used_mb) + RESERVE_MB
    return _too_little("memory", needed_mb, have.left_mb()) or _too_little(
        "GPU memory", needs.gpu_memory_mb, have.gpu_left_mb(needed_mb)
    )


def _too_little(what: str, needed_mb: int, left_mb: int) -> str:
    if needed_mb <= left_mb:
        return ""
    return f"there is no {what} for two at once: {needed_mb} MB are needed, {left_mb} MB are left"


def used_mb(pids: Collection[int]) -> int:
    """Memory that processes have for themselves alone: what is free once they are gone. Blocks."""
    return private_bytes(pids) // 2**20

"""Whether the memory is there that a payload asks for: free, and not promised to another one.

What a payload was promised and does not use yet looks free. How much main memory each worker uses
is known; of GPU memory only what all workers use together.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from nondum.sdk.codec.values import from_plain
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.format.manifest import Requires
from nondum.wheelhouse.payload import gpu
from nondum.wheelhouse.payload.gpu import Gpu

MAX_TOLD = 3
"""Payloads that are told by name."""


@frozen
class Promised:
    """What other payloads of a host were promised, all of them together, in MB."""

    memory_mb: int = 0
    unused_mb: int = 0
    """Of `memory_mb`, what they do not use yet."""
    gpu_memory_mb: int = 0
    holders: tuple[str, ...] = ()
    """Payloads that have memory which they do not use yet."""
    gpu_holders: tuple[str, ...] = ()
    """Payloads that were promised GPU memory."""

    @classmethod
    def parse(cls, said: Mapping[str, Any]) -> Promised:
        """Read what a daemon tells its children."""
        return from_plain(cls, said)


@frozen
class Memory:
    """What a host has, in MB."""

    free_mb: int
    """What can be had without swapping."""
    gpu: Gpu | None = None
    """None: no GPU that is known of."""
    promised: Promised = Promised()

    def left_mb(self) -> int:
        """Memory for one more payload.

        >>> Memory(1000, promised=Promised(500, 300)).left_mb()
        700
        """
        left = self.free_mb - self.promised.unused_mb
        if self.gpu is not None and self.gpu.is_shared:
            taken = self.promised.memory_mb + self.promised.gpu_memory_mb
            left = min(left, self.gpu.total_mb - taken)
        return max(0, left)

    def gpu_left_mb(self, memory_mb: int, kind: str = "") -> int:
        """GPU memory for one more payload, which takes so much memory; of a kind, or of any.

        >>> Memory(1000, Gpu(3000, 4000), Promised(gpu_memory_mb=1500)).gpu_left_mb(0)
        2500
        >>> Memory(1000, Gpu(1000, 4000, is_shared=True)).gpu_left_mb(600)
        400
        """
        if self.gpu is None or (not kind and self.gpu.kinds == ("opencl",)):
            return 0  # whose author names no kind means one that most programs can use
        if self.gpu.is_shared:
            return max(0, self.left_mb() - memory_mb)
        return max(0, min(self.gpu.free_mb, self.gpu.total_mb - self.promised.gpu_memory_mb))

    def with_freed(self, memory_mb: int, gpu_memory_mb: int) -> Memory:
        """As it is once somebody has ended who uses so much; of the GPU's, at most so much.

        >>> after = Memory(1000, Gpu(3000, 4000)).with_freed(100, 1500)
        >>> after.free_mb, after.gpu
        (1100, Gpu(free_mb=4000, total_mb=4000, is_shared=False, kinds=()))
        """
        gpu = self.gpu
        if gpu is None:
            return replace(self, free_mb=self.free_mb + memory_mb)
        freed_mb = memory_mb + (gpu_memory_mb if gpu.is_shared else 0)
        gpu_free_mb = min(gpu.free_mb + gpu_memory_mb, gpu.total_mb)
        return replace(self, free_mb=self.free_mb + freed_mb, gpu=replace(gpu, free_mb=gpu_free_mb))


def problems(needs: Requires, have: Memory, payload_id: str) -> Iterator[Problem]:
    """What there is too little of for a payload, or not at all: NO_MEMORY, NO_GPU_KIND,
    NO_GPU_MEMORY."""
    left_mb, gpu_left_mb = have.left_mb(), have.gpu_left_mb(needs.memory_mb, needs.gpu_kind)
    if needs.memory_mb > left_mb:
        why, fix = _because(have.promised.unused_mb, have.promised.holders)
        yield Problem(
            "NO_MEMORY",
            f"there is too little memory{why}",
            where=payload_id,
            need=f"{needs.memory_mb} MB",
            have=f"{left_mb} MB",
            fix=fix or "free some memory, or use another host",
        )
    kinds = have.gpu.kinds if have.gpu is not None else ()
    if needs.gpu_kind and needs.gpu_kind not in kinds:
        yield Problem(
            "NO_GPU_KIND",
            f"there is no GPU that programs use by {needs.gpu_kind}",
            where=payload_id,
            need=f"a GPU of kind {needs.gpu_kind}",
            have=", ".join(kinds) or "none",
            fix="use another host",
        )
    elif needs.gpu_memory_mb > gpu_left_mb:
        why, fix = _because(have.promised.gpu_memory_mb, have.promised.gpu_holders)
        yield Problem(
            "NO_GPU_MEMORY",
            f"there is too little GPU memory{why}",
            where=payload_id,
            need=f"{needs.gpu_memory_mb} MB",
            have=f"{gpu_left_mb} MB",
            fix=fix or "free some GPU memory, or use another host",
        )


def _because(promised_mb: int, holders: Sequence[str]) -> tuple[str, str]:
    """Why there is too little and what to do, where others were promised some; else nothing."""
    if not promised_mb:
        return "", ""
    names = ", ".join(holders[:MAX_TOLD]) + (" …" if len(holders) > MAX_TOLD else "")
    which = "one of them" if len(holders) > 1 else "it"
    fix = f"pull or uninstall {which}, or use another host"
    return f", since {promised_mb} MB are promised to {names}", fix


def look(gpu_look: Callable[[int, int], Gpu | None] = gpu.look) -> Memory:
    """This machine's memory, of which nothing is known to be promised. A process that stays gives
    `gpu.look_aside`."""
    found = _looked_up()
    free_mb = found["MemAvailable"]
    return Memory(free_mb, gpu_look(free_mb, found["MemTotal"]))


def free_memory_mb() -> int:
    """Memory that can be had without swapping, in MB."""
    return _looked_up()["MemAvailable"]


def _looked_up() -> dict[str, int]:
    """What the kernel tells of memory (proc_meminfo(5)), in MB."""
    lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
    rows = (line.split() for line in lines)
    return {name.rstrip(":"): int(size) // 1024 for name, size, *_ in rows}

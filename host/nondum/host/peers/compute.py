"""What a host offers to compute with: the resource that a compute payload is."""

from __future__ import annotations

import os
import platform
from importlib import metadata
from pathlib import Path
from typing import Any

from nondum.wheelhouse.payload import gpu, memory
from nondum.wheelhouse.store import disk

Compute = dict[str, Any]


def probed(state: Path, *, reserve_mb: int) -> Compute:
    """Look at this machine. Takes some ten milliseconds, and more where NVML is asked.

    `machine`, `python`, `processors`, `memory_mb` and `disk_mb` that are free, `nondum`;
    `gpu_memory_mb` is None without a GPU, `gpu_kinds` are of `manifest.GPU_KINDS`.
    """
    free = memory.look(gpu.look_aside)
    return {
        "machine": platform.machine(),
        "python": platform.python_version(),
        "processors": len(os.sched_getaffinity(0)),
        "memory_mb": free.free_mb,
        "gpu_memory_mb": free.gpu.free_mb if free.gpu is not None else None,
        "gpu_kinds": list(free.gpu.kinds) if free.gpu is not None else [],
        "disk_mb": disk.free_mb(state, reserve_mb),
        "nondum": metadata.version("nondum"),
    }

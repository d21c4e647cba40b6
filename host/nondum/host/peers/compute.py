"""What a host offers to compute with: the resource that a compute payload is."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from nondum.wheelhouse.format.confinement import Level
from nondum.wheelhouse.payload import preflight

Compute = dict[str, Any]


def probed(state: Path, *, reserve_mb: int) -> Compute:
    """Look at this machine. Takes some ten milliseconds; `gpu_memory_mb` is None without a GPU.

    `machine`, `python`, `processors`, `memory_mb` and `disk_mb` that are free, `nondum`.
    """
    facts = preflight.probe(state, reserve_mb=reserve_mb, confinement=Level.NONE)
    gpu = facts.memory.gpu
    return {
        "machine": facts.architecture,
        "python": facts.python,
        "processors": len(os.sched_getaffinity(0)),
        "memory_mb": facts.memory.free_mb,
        "gpu_memory_mb": gpu.free_mb if gpu is not None else None,
        "disk_mb": facts.free_disk_mb,
        "nondum": facts.nondum,
    }

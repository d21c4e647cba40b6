"""How much memory GPUs have free: what NVML says, or the system's own where a GPU shares it.

NVML is asked through nvidia-ml-py where that is installed (`nondum[gpu]`), and only by processes
that end soon: it keeps memory and threads.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

MODEL = Path("/proc/device-tree/model")
SHARING = ("Jetson", "Raspberry Pi")
"""Boards whose GPU uses the system's memory, and which have no NVML."""
_MB = 1024 * 1024


def free_memory_mb(system_memory_mb: Callable[[], int], *, model: Path = MODEL) -> int | None:
    """The free memory of the GPU that has most of it; None where no GPU is known of."""
    if shares_memory(_text(model)):
        return system_memory_mb()
    return _asked_of_nvml()


def shares_memory(model: str) -> bool:
    """Whether a board's model is one whose GPU uses the system's memory.

    >>> shares_memory("NVIDIA Jetson Orin Nano Developer Kit"), shares_memory("")
    (True, False)
    """
    return any(name in model for name in SHARING)


def _asked_of_nvml() -> int | None:
    try:
        import pynvml
    except ImportError:
        return None
    try:
        pynvml.nvmlInit()
        handles = map(pynvml.nvmlDeviceGetHandleByIndex, range(pynvml.nvmlDeviceGetCount()))
        free = [int(pynvml.nvmlDeviceGetMemoryInfo(handle).free) for handle in handles]
    except pynvml.NVMLError:  # no driver, or no device
        return None
    return max(free) // _MB if free else None


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace").rstrip("\0")
    except OSError:
        return ""

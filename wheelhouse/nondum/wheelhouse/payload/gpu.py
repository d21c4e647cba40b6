"""What memory GPUs have: what NVML says, or the system's own where a GPU shares it.

NVML is asked through nvidia-ml-py, and only by processes that end soon: it keeps memory and
threads.
"""

from __future__ import annotations

from pathlib import Path

from nondum.sdk.frozen import frozen

MODEL = Path("/proc/device-tree/model")
SHARING = ("Jetson", "Raspberry Pi")
"""Boards whose GPU uses the system's memory, and which have no NVML."""
_MB = 1024 * 1024


@frozen
class Gpu:
    """The memory of a host's GPUs."""

    free_mb: int
    """Of the GPU that has most of it: what one payload may find."""
    total_mb: int
    """Of all of them, used or not."""
    is_shared: bool = False
    """Whether it is the system's own memory."""


def look(system_free_mb: int, system_total_mb: int, *, model: Path = MODEL) -> Gpu | None:
    """The GPUs of this machine; None where none is known of."""
    if shares_memory(_text(model)):
        return Gpu(system_free_mb, system_total_mb, is_shared=True)
    return _asked_of_nvml()


def shares_memory(model: str) -> bool:
    """Whether a board's model is one whose GPU uses the system's memory.

    >>> shares_memory("NVIDIA Jetson Orin Nano Developer Kit"), shares_memory("")
    (True, False)
    """
    return any(name in model for name in SHARING)


def _asked_of_nvml() -> Gpu | None:
    import pynvml  # not by those that only judge what others saw

    try:
        pynvml.nvmlInit()
        handles = map(pynvml.nvmlDeviceGetHandleByIndex, range(pynvml.nvmlDeviceGetCount()))
        every = [pynvml.nvmlDeviceGetMemoryInfo(handle) for handle in handles]
    except pynvml.NVMLError:  # no driver, or no device
        return None
    if not every:
        return None
    free, total = max(int(one.free) for one in every), sum(int(one.total) for one in every)
    return Gpu(free // _MB, total // _MB)


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace").rstrip("\0")
    except OSError:
        return ""

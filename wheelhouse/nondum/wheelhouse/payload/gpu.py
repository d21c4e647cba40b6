"""The GPU of a machine: how programs can use it, and what memory it has.

NVML is asked through nvidia-ml-py, and only by processes that end soon, or in a child
(`look_aside`): it keeps memory and threads, and may hang. Where a machine has several, `look`
returns the first of these: NVIDIA's, AMD's, another with OpenCL, sharing the system's memory.
"""

from __future__ import annotations

import contextlib
import json
import logging
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from nondum.sdk.codec.values import from_plain, to_plain
from nondum.sdk.frozen import frozen

ROOT = Path("/")
SHARING = {"Jetson": ("cuda",), "Raspberry Pi": ("v3d",)}
"""Boards whose GPU uses the system's memory, and which have no NVML → its kinds."""
ASIDE_S = 20.0
"""How long a child is waited for that asks NVML: a driver that wakes a GPU takes seconds."""
ENDS_S = 2.0
_MB = 1024 * 1024
_AMD = "0x1002"
"""The vendor's number (PCI)."""
_NO_GPU = ("pocl",)
"""Drivers of OpenCL that compute on the processor."""
log = logging.getLogger(__name__)


@frozen
class Gpu:
    """The memory of a host's GPUs, and their kinds."""

    free_mb: int
    """Of the GPU that has most of it: what one payload may find."""
    total_mb: int
    """Of all of them, used or not."""
    is_shared: bool = False
    """Whether it is the system's own memory."""
    kinds: tuple[str, ...] = ()
    """Of `manifest.GPU_KINDS`."""


def look(system_free_mb: int, system_total_mb: int, *, root: Path = ROOT) -> Gpu | None:
    """The GPUs of this machine; None where none is known of."""
    shared = Gpu(system_free_mb, system_total_mb, is_shared=True)
    model = _text(root / "proc/device-tree/model")
    if (kinds := kinds_of_board(model)) is not None:
        found: Gpu | None = replace(shared, kinds=kinds)
    else:
        found = _asked_of_nvml(root) or _told_by_amdgpu(root)
    if not _has_opencl(root):
        return found
    found = found or shared
    return replace(found, kinds=(*found.kinds, "opencl"))


def look_aside(
    system_free_mb: int, system_total_mb: int, *, root: Path = ROOT, seconds: float = ASIDE_S
) -> Gpu | None:
    """The same, for a process that stays: where NVML would be asked, a child asks it. Blocks; logs
    a warning where the child hangs or crashes."""
    if not _has_nvidia(root):
        return look(system_free_mb, system_total_mb, root=root)
    asked = (str(root), str(system_free_mb), str(system_total_mb))
    command = (sys.executable, "-P", "-m", "nondum.wheelhouse.payload.gpu", *asked)
    try:
        with tempfile.TemporaryFile() as out:
            child = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=out)
            try:
                status = child.wait(seconds)
            finally:
                child.kill()
                with contextlib.suppress(subprocess.TimeoutExpired):  # it hangs in its driver
                    child.wait(ENDS_S)
            out.seek(0)
            told = json.loads(out.read().splitlines()[-1]) if status == 0 else None
    except (OSError, subprocess.SubprocessError, ValueError, IndexError) as error:
        log.warning("NVML does not say what GPU there is: %s", error)
        return None
    return from_plain(Gpu, told) if told is not None else None


def kinds_of_board(model: str) -> tuple[str, ...] | None:
    """The kinds of a board's GPU that uses the system's memory; None: it is no such board.

    >>> kinds_of_board("NVIDIA Jetson Orin Nano Developer Kit"), kinds_of_board("")
    (('cuda',), None)
    """
    return next((kinds for name, kinds in SHARING.items() if name in model), None)


def _asked_of_nvml(root: Path) -> Gpu | None:
    if not _has_nvidia(root):
        return None
    import pynvml  # takes 30 ms, which a payload would wait for

    try:
        pynvml.nvmlInit()
        handles = map(pynvml.nvmlDeviceGetHandleByIndex, range(pynvml.nvmlDeviceGetCount()))
        every = [pynvml.nvmlDeviceGetMemoryInfo(handle) for handle in handles]
    except pynvml.NVMLError:  # no driver, or no device
        return None
    return _together(((int(one.free), int(one.total)) for one in every), "cuda")


def _has_nvidia(root: Path) -> bool:
    return (root / "proc/driver/nvidia").exists()


def _told_by_amdgpu(root: Path) -> Gpu | None:
    """What the driver tells in sysfs (kernel documentation, "AMDGPU driver", memory); of use to
    programs where there is the device node of ROCm."""
    if not (root / "dev/kfd").exists():
        return None
    return _together(_memory_of_amd(root), "rocm")


def _memory_of_amd(root: Path) -> Iterator[tuple[int, int]]:
    for device in sorted((root / "sys/class/drm").glob("card[0-9]*/device")):
        used, total = (_text(device / f"mem_info_vram_{what}") for what in ("used", "total"))
        if _text(device / "vendor") == _AMD and used.isdecimal() and total.isdecimal():
            yield int(total) - int(used), int(total)


def _together(each: Iterator[tuple[int, int]], kind: str) -> Gpu | None:
    """Several of one kind: free and all bytes of each."""
    every = list(each)
    if not every:
        return None
    free, total = max(free for free, _ in every), sum(total for _, total in every)
    return Gpu(free // _MB, total // _MB, kinds=(kind,))


def _has_opencl(root: Path) -> bool:
    """Whether a driver of OpenCL for a GPU is installed (cl_khr_icd), and a GPU there to use."""
    drivers = [path.stem for path in (root / "etc/OpenCL/vendors").glob("*.icd")]
    has_driver = any(not name.startswith(_NO_GPU) for name in drivers)
    nodes = ("dri/renderD*", "nvidia[0-9]*", "kfd")
    return has_driver and any(any((root / "dev").glob(pattern)) for pattern in nodes)


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace").strip("\0\n ")
    except OSError:
        return ""


if __name__ == "__main__":  # the child of `look_aside`
    _found = look(int(sys.argv[2]), int(sys.argv[3]), root=Path(sys.argv[1]))
    sys.stdout.write(json.dumps(to_plain(_found)))

"""GPU memory: dedicated, shared with the system, or unknown."""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import pytest

from nondum.wheelhouse.payload import gpu
from nondum.wheelhouse.payload.gpu import Gpu

MB = 1024 * 1024


@dataclass
class Info:
    """What NVML says of one device."""

    free: int
    total: int


class NoDriver(Exception):
    """What NVML raises."""


def nvml(*devices: tuple[int, int], has_driver: bool = True) -> ModuleType:
    """Stands for nvidia-ml-py on a machine with such devices: free and all memory, in MB."""

    def init() -> None:
        if not has_driver:
            raise NoDriver

    def info(number: int) -> Info:
        free, total = devices[number]
        return Info(free * MB, total * MB)

    module = ModuleType("pynvml")
    module.__dict__.update(
        NVMLError=NoDriver,
        nvmlInit=init,
        nvmlDeviceGetCount=lambda: len(devices),
        nvmlDeviceGetHandleByIndex=lambda number: number,
        nvmlDeviceGetMemoryInfo=info,
    )
    return module


def machine(root: Path, **files: str) -> Path:
    """One whose kernel and system say this; `__` stands for `/`, and an ending is left out."""
    for name, text in files.items():
        path = root / name.replace("__", "/").replace("icd", ".icd")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return root


JETSON = {"proc__device-tree__model": "NVIDIA Jetson Orin Nano Developer Kit\0"}
PI = {"proc__device-tree__model": "Raspberry Pi 4 Model B Rev 1.5\0"}
RADEON = {
    "sys__class__drm__card1__device__vendor": "0x1002\n",
    "sys__class__drm__card1__device__mem_info_vram_total": f"{8000 * MB}\n",
    "sys__class__drm__card1__device__mem_info_vram_used": f"{3000 * MB}\n",
    "dev__kfd": "",
}
NVIDIA = {"proc__driver__nvidia__version": "NVRM version: NVIDIA UNIX x86_64 Kernel Module"}
INTEL = {"etc__OpenCL__vendors__intelicd": "libigdrcl.so", "dev__dri__renderD128": ""}


@pytest.fixture(autouse=True)
def no_nvml(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pynvml", nvml(has_driver=False))


@pytest.mark.parametrize(
    ("files", "found"),
    [
        ({}, None),
        (JETSON, Gpu(1234, 8000, is_shared=True, kinds=("cuda",))),
        (PI, Gpu(1234, 8000, is_shared=True, kinds=("v3d",))),
        (RADEON, Gpu(5000, 8000, kinds=("rocm",))),
        ({**RADEON, "dev__kfd": None}, None),
        (INTEL, Gpu(1234, 8000, is_shared=True, kinds=("opencl",))),
        ({**RADEON, **INTEL}, Gpu(5000, 8000, kinds=("rocm", "opencl"))),
        ({**INTEL, "dev__dri__renderD128": None}, None),
        ({"etc__OpenCL__vendors__poclicd": "", "dev__dri__renderD128": ""}, None),
        ({**RADEON, "sys__class__drm__card1__device__mem_info_vram_used": "much"}, None),
    ],
)
def test_what_a_machine_says_is_a_gpu_of_its_kinds(
    tmp_path: Path, files: dict[str, str | None], found: Gpu | None
) -> None:
    there = {name: text for name, text in files.items() if text is not None}
    assert gpu.look(1234, 8000, root=machine(tmp_path, **there)) == found


def test_one_payload_finds_what_the_emptiest_gpu_has(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setitem(sys.modules, "pynvml", nvml((100, 4000), (3000, 8000)))
    assert gpu.look(0, 0, root=machine(tmp_path, **NVIDIA)) == Gpu(3000, 12000, kinds=("cuda",))


@pytest.mark.parametrize("module", [nvml(), nvml((1, 1), has_driver=False)])
def test_no_device_and_no_driver_are_no_gpu(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, module: ModuleType
) -> None:
    monkeypatch.setitem(sys.modules, "pynvml", module)
    assert gpu.look(0, 0, root=machine(tmp_path, **NVIDIA)) is None


# Asked by a process that stays, in a child

ANSWERS = """
class NVMLError(Exception): pass
class Info: free, total = 3 << 30, 8 << 30
def nvmlInit(): pass
def nvmlDeviceGetCount(): return 1
def nvmlDeviceGetHandleByIndex(number): return number
def nvmlDeviceGetMemoryInfo(handle): return Info
"""
HANGS = "import time\ntime.sleep(3600)\n"
CRASHES = "import os\nos.abort()\n"


@pytest.mark.parametrize(
    ("module", "seconds", "found"),
    [
        (ANSWERS, 60.0, Gpu(3072, 8192, kinds=("cuda",))),
        (HANGS, 0.2, None),
        (CRASHES, 60.0, None),
    ],
    ids=["answers", "hangs", "crashes"],
)
def test_nvml_is_asked_in_a_child_by_a_process_that_stays(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    module: str,
    seconds: float,
    found: Gpu | None,
) -> None:
    (tmp_path / "pynvml.py").write_text(module)
    path = (str(tmp_path), *sys.path)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(path))
    root = machine(tmp_path, **NVIDIA)
    assert gpu.look_aside(0, 0, root=root, seconds=seconds) == found


def test_no_child_is_started_where_nvml_is_not_asked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "executable", "/nonexistent")
    assert gpu.look_aside(1234, 8000, root=machine(tmp_path, **INTEL)) == Gpu(
        1234, 8000, is_shared=True, kinds=("opencl",)
    )

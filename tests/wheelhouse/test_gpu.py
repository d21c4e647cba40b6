"""GPU memory: dedicated, shared with the system, or unknown."""

from __future__ import annotations

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


@pytest.fixture
def no_board(tmp_path: Path) -> Path:
    """A machine that is no board has no such file."""
    return tmp_path / "none"


def test_a_board_that_shares_memory_answers_with_the_systems(tmp_path: Path) -> None:
    model = tmp_path / "model"
    model.write_bytes(b"NVIDIA Jetson Orin Nano Developer Kit\0")
    assert gpu.look(1234, 8000, model=model) == Gpu(1234, 8000, is_shared=True)


def test_another_machine_is_never_answered_for_by_the_systems_memory(no_board: Path) -> None:
    found = gpu.look(-1, -1, model=no_board)
    assert found is None or (found.free_mb > 0 and not found.is_shared)


def test_one_payload_finds_what_the_emptiest_gpu_has(
    monkeypatch: pytest.MonkeyPatch, no_board: Path
) -> None:
    monkeypatch.setitem(sys.modules, "pynvml", nvml((100, 4000), (3000, 8000)))
    assert gpu.look(0, 0, model=no_board) == Gpu(3000, 12000)


@pytest.mark.parametrize("module", [nvml(), nvml((1, 1), has_driver=False)])
def test_no_device_and_no_driver_are_no_gpu(
    monkeypatch: pytest.MonkeyPatch, no_board: Path, module: ModuleType
) -> None:
    monkeypatch.setitem(sys.modules, "pynvml", module)
    assert gpu.look(0, 0, model=no_board) is None

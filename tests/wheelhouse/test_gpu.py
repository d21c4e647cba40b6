"""GPU memory: of its own, shared with the system, or unknown."""

from __future__ import annotations

from pathlib import Path

from nondum.wheelhouse import gpu


def test_a_board_that_shares_memory_answers_with_the_systems(tmp_path: Path) -> None:
    model = tmp_path / "model"
    model.write_bytes(b"NVIDIA Jetson Orin Nano Developer Kit\0")
    assert gpu.free_memory_mb(lambda: 1234, model=model) == 1234


def test_another_machine_is_never_answered_for_by_the_systems_memory(tmp_path: Path) -> None:
    def never() -> int:
        raise AssertionError("a GPU's own memory is not the system's")

    free = gpu.free_memory_mb(never, model=tmp_path / "none")
    assert free is None or free > 0

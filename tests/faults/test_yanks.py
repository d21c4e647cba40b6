"""Drives that are yanked at any moment leave nothing.

500 times is `python -m tests.faults.drive_figures yanks`.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from tests.faults.yanks import bench, yank_all

pytestmark = [
    pytest.mark.anyio,
    pytest.mark.skipif(
        os.geteuid() != 0 or not Path("/dev/loop-control").exists(),
        reason="loop devices need root",
    ),
]

POINTS = 10


async def test_yanked_drives_leave_nothing(tmp_path: Path) -> None:
    async with bench(tmp_path) as made:
        told = await yank_all(made, POINTS, seed=5)
    assert len(told.all_seconds) == POINTS
    assert not told.stuck_mounts
    assert not told.left_over
    assert not told.disturbed

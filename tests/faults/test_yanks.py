"""Drives that are yanked leave nothing, whatever was going on.

500 times at any moment is `python -m tests.faults.drive_figures yanks`.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from tests.faults.yanks import PHASES, bench

pytestmark = [
    pytest.mark.anyio,
    pytest.mark.skipif(
        os.geteuid() != 0 or not Path("/dev/loop-control").exists(),
        reason="loop devices need root",
    ),
]


async def test_yanked_drives_leave_nothing(tmp_path: Path) -> None:
    async with bench(tmp_path) as made:
        for phase in PHASES:
            await made.yank_at(phase)
    told = made.told
    assert len(told.all_seconds) == len(PHASES)
    assert not told.stuck_mounts
    assert not told.left_over
    assert not told.disturbed

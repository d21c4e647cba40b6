"""A house of workers for every test; nothing of it may be left."""

from __future__ import annotations

from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from tests.kit.house import House, is_alive


@pytest.fixture
async def house(tmp_path: Path) -> AsyncIterator[House]:
    """Workers with short patience, ended after the test."""
    made = House(tmp_path)
    yield made
    pids = made.workers.pids().values()
    await made.workers.close(grace_s=1.0)
    assert not [pid for pid in pids if is_alive(pid)], "workers are left"

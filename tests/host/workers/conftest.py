"""Workers for every test; none of them may be left."""

from __future__ import annotations

from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from tests.kit.workers import WorkersUnderTest, is_alive


@pytest.fixture
async def tested(tmp_path: Path) -> AsyncIterator[WorkersUnderTest]:
    """Workers with short patience, ended after the test."""
    made = WorkersUnderTest(tmp_path)
    yield made
    pids = made.workers.pids().values()
    await made.workers.close(grace_s=1.0)
    assert not [pid for pid in pids if is_alive(pid)], "workers are left"

"""Workers for every test; none of them may be left."""

from __future__ import annotations

from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from tests.kit.clock import VirtualClock
from tests.kit.workers import WorkersUnderTest


@pytest.fixture
async def tested(tmp_path: Path, clock: VirtualClock) -> AsyncIterator[WorkersUnderTest]:
    """Workers that are judged in virtual time, ended after the test."""
    made = WorkersUnderTest(tmp_path)
    yield made
    await made.close(clock)

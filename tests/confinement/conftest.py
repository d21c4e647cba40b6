"""What tests of rooms share."""

from __future__ import annotations

import shutil
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from tests.kit.workers import WorkersUnderTest

from nondum.host.workers.confinements import Boxed


@pytest.fixture
async def tested(tmp_path: Path) -> AsyncIterator[WorkersUnderTest]:
    tested = WorkersUnderTest(tmp_path, confinement=Boxed(shutil.which("bwrap") or "bwrap"))
    yield tested
    await tested.workers.close(grace_s=1.0)

"""What tests of sandboxes share."""

from __future__ import annotations

import shutil
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from tests.kit.workers import WorkersUnderTest

from nondum.host.workers.boxed import Boxed


@pytest.fixture
def has_users() -> bool:
    """Whether each worker is a separate user."""
    return False


@pytest.fixture
async def tested(tmp_path: Path, has_users: bool) -> AsyncIterator[WorkersUnderTest]:
    confinement = Boxed(shutil.which("bwrap") or "bwrap", has_users=has_users)
    tested = WorkersUnderTest(tmp_path, confinement=confinement)
    yield tested
    await tested.workers.close(grace_s=1.0)

"""A hostile plugin tries everything it can think of, at every level that this machine has."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from tests.confinement.baits import LEFT_WHEN_RESTRICTED, attempted, laid
from tests.confinement.escape import ATTEMPTS

from nondum.host.workers.confinements import Boxed, Confinement, Held, Unconfined

pytestmark = pytest.mark.anyio


@pytest.fixture
def bait(tmp_path: Path) -> Iterator[dict[str, Any]]:
    with laid(tmp_path) as bait:
        yield bait


async def test_nothing_leaves_a_room(tmp_path: Path, bait: dict[str, Any]) -> None:
    assert await reached(tmp_path, bait, Boxed(shutil.which("bwrap") or "bwrap")) == set()


async def test_little_is_reached_by_a_restricted_worker(
    tmp_path: Path, bait: dict[str, Any]
) -> None:
    assert await reached(tmp_path, bait, Held()) <= LEFT_WHEN_RESTRICTED


async def test_baits_are_there_to_be_reached(tmp_path: Path, bait: dict[str, Any]) -> None:
    """Else the others would prove nothing."""
    found = await reached(tmp_path, bait, Unconfined())
    assert found >= {name for name in ATTEMPTS if name.startswith(("read a", "connect", "signal"))}


async def reached(folder: Path, bait: dict[str, Any], confinement: Confinement) -> set[str]:
    results = await attempted(folder, bait, confinement)
    assert set(results) == set(ATTEMPTS)
    return {name for name, result in results.items() if result.could}

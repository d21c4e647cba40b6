"""A hostile plugin tries everything it can think of, at every level that this machine has."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from tests.sandbox.baits import LEFT_WHEN_RESTRICTED, SHARED_MEMORY, attempted, laid, unlimited
from tests.sandbox.escape import ATTEMPTS

from nondum.host.sandbox.cgroups import Cgroups
from nondum.host.sandbox.cgroups.groups import NoTree
from nondum.host.workers.boxed import Boxed
from nondum.host.workers.confinement import Confinement
from nondum.host.workers.held import Held
from nondum.host.workers.unconfined import Unconfined

pytestmark = pytest.mark.anyio


@pytest.fixture
def bait(tmp_path: Path) -> Iterator[dict[str, Any]]:
    with laid(tmp_path) as bait:
        yield bait


@pytest.mark.parametrize("has_users", [False, *([True] if os.geteuid() == 0 else [])])
async def test_nothing_leaves_a_sandbox(
    tmp_path: Path, bait: dict[str, Any], has_users: bool
) -> None:
    boxed = Boxed(shutil.which("bwrap") or "bwrap", has_users=has_users)
    assert await reached(tmp_path, bait, boxed) == set()


async def test_without_memory_cgroups_shared_memory_is_not_limited(
    tmp_path: Path, bait: dict[str, Any]
) -> None:
    """What docs/confinement.md says of such machines is so. Private memory is limited there, too"""
    names = ["take all memory", *sorted(SHARED_MEMORY)]
    boxed, no_cgroups = Boxed(shutil.which("bwrap") or "bwrap"), Cgroups(NoTree())
    results = await attempted(tmp_path, bait, boxed, names, cgroups=no_cgroups)
    assert {name for name, result in results.items() if result.could} == SHARED_MEMORY


async def test_little_is_reached_by_a_restricted_worker(
    tmp_path: Path, bait: dict[str, Any]
) -> None:
    assert await reached(tmp_path, bait, Held()) <= LEFT_WHEN_RESTRICTED


async def test_as_little_is_reached_where_landlock_is_older(
    tmp_path: Path, bait: dict[str, Any]
) -> None:
    """Linux 5.19 to 6.1, as Debian 12 has it: before Landlock knew truncating, and signals."""
    assert await reached(tmp_path, bait, Held(abi=2)) <= LEFT_WHEN_RESTRICTED | {"signal the host"}


async def test_no_special_file_is_left_without_confinement(
    tmp_path: Path, bait: dict[str, Any]
) -> None:
    names = ["leave a set id file", *(["make a device node"] if os.geteuid() == 0 else [])]
    results = await attempted(tmp_path / "held", bait, Unconfined(), names)
    assert not any(results[name].could for name in names), results
    free = Unconfined(without=["special files"])
    results = await attempted(tmp_path / "free", bait, free, names)
    assert all(results[name].could for name in names), results


async def test_baits_are_there_to_be_reached(tmp_path: Path, bait: dict[str, Any]) -> None:
    """Else the others would prove nothing."""
    found = await reached(tmp_path, bait, Unconfined())
    assert found >= {name for name in ATTEMPTS if name.startswith(("read a", "connect", "signal"))}


async def reached(folder: Path, bait: dict[str, Any], confinement: Confinement) -> set[str]:
    results = await attempted(folder, bait, confinement)
    assert set(results) == set(ATTEMPTS)
    could = {name for name, result in results.items() if result.could}
    return could - unlimited(folder)

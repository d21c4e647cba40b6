"""Backups are made when something changed, two are kept, and one is whole at any moment."""

from __future__ import annotations

import asyncio
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from nondum.host.catalogue import backups
from nondum.host.catalogue.backups import Backups
from nondum.host.catalogue.catalogue import Catalogue
from nondum.host.catalogue.reserve import RESERVE_BYTES, Reserve
from nondum.host.core.state import HostState

pytestmark = pytest.mark.anyio


def revision(backup: Path) -> int:
    with closing(sqlite3.connect(f"file:{backup}?immutable=1", uri=True)) as connection:
        (found,) = connection.execute("SELECT revision FROM host").fetchone()
    return int(found)


async def committed(path: Path, *revisions: int) -> Backups:
    catalogue = await Catalogue.open(path / "catalogue.sqlite", "spot")
    for number in revisions:
        await catalogue.commit(HostState("spot", number), ())
        catalogue.backups.make()
    await catalogue.close()
    return catalogue.backups


async def test_last_two_are_kept(tmp_path: Path) -> None:
    kept = await committed(tmp_path, 1, 2, 3)
    assert [revision(backup) for backup in kept.found()] == [3, 2]


async def test_damaged_backup_is_passed_over(tmp_path: Path) -> None:
    kept = await committed(tmp_path, 1, 2)
    kept.newest.write_bytes(b"\0" * 10_000)
    assert [revision(backup) for backup in kept.found()] == [1]


async def test_backup_that_was_not_finished_is_no_obstacle(tmp_path: Path) -> None:
    kept = await committed(tmp_path, 1)
    (kept.folder / ".newest.part").write_bytes(b"half")
    kept.newest.rename(kept.before)
    assert [revision(backup) for backup in kept.found()] == [1]
    kept.make()
    assert [revision(backup) for backup in kept.found()] == [1, 1]


async def test_backups_are_made_only_when_something_changed(tmp_path: Path) -> None:
    catalogue = await Catalogue.open(tmp_path / "catalogue.sqlite", "spot")
    asked = asyncio.Event()
    made = []

    def now() -> int:
        asked.set()
        made.append(catalogue.backups.newest.exists() and revision(catalogue.backups.newest))
        return catalogue.revision

    async def look() -> None:
        asked.clear()
        await asked.wait()

    await catalogue.commit(HostState("spot", 1), ())
    keeping = asyncio.create_task(backups.keep(catalogue.backups, now, 0.02, pace_s=0.01))
    while not made or made[-1] != 1:
        await look()
    written = catalogue.backups.newest.stat().st_mtime_ns
    for _ in range(3):
        await look()
    assert catalogue.backups.newest.stat().st_mtime_ns == written
    await catalogue.commit(HostState("spot", 2), ())
    while made[-1] != 2:
        await look()
    keeping.cancel()
    await asyncio.gather(keeping, return_exceptions=True)
    await catalogue.close()


async def test_reserve_takes_disk_space_and_gives_it_back(tmp_path: Path) -> None:
    reserve = Reserve(tmp_path / "reserve")
    assert reserve.take()
    assert reserve.path.stat().st_blocks * 512 >= RESERVE_BYTES
    assert reserve.take()
    assert reserve.release()
    assert not reserve.path.exists()
    assert not reserve.release()

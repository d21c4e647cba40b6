"""Backups are made when something changed, two are kept, and one is whole at any moment."""

from __future__ import annotations

import asyncio
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest

from nondum.host.catalogue import backups, database
from nondum.host.catalogue.backups import Backups
from nondum.host.catalogue.catalogue import Catalogue
from nondum.host.catalogue.opening import Instead
from nondum.host.catalogue.reserve import RESERVE_BYTES, Reserve
from nondum.host.core.state import Highwater, HostState
from nondum.sdk.errors import ConfigRefused

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


NEXT = database.SCHEMA + 1


@contextmanager
def newer_nondum() -> Iterator[None]:
    """What the next version does to a catalogue."""
    with pytest.MonkeyPatch.context() as patched:
        change = "ALTER TABLE drives ADD COLUMN colour TEXT NOT NULL DEFAULT '';"
        patched.setattr(database, "_UPGRADES", {database.SCHEMA: change})
        patched.setattr(database, "SCHEMA", NEXT)
        yield


def knowing(revision: int, **releases: int) -> HostState:
    highwater = {name: Highwater(number, f"{number:064}") for name, number in releases.items()}
    return HostState("spot", revision, highwater=highwater)


async def written(path: Path, state: HostState) -> None:
    catalogue = await Catalogue.open(path / "catalogue.sqlite", "spot")
    await catalogue.commit(state, ())
    await catalogue.close()


async def test_older_nondum_continues_where_it_was_but_knows_the_newest_releases(
    tmp_path: Path,
) -> None:
    await written(tmp_path, knowing(3, lamp=1, torch=5))
    with newer_nondum():
        await written(tmp_path, knowing(9, lamp=4, torch=5, eye=1))
    for is_told in (True, False):  # once
        catalogue = await Catalogue.open(tmp_path / "catalogue.sqlite", "spot")
        await catalogue.close()
        assert catalogue.state == knowing(3, lamp=4, torch=5, eye=1)
        assert (catalogue.loss is not None) is is_told
        if catalogue.loss is not None:
            assert catalogue.loss.instead is Instead.FORMER
            assert catalogue.loss.aside is not None and catalogue.loss.aside.exists()
    with newer_nondum():
        await written(tmp_path, knowing(4))


@pytest.mark.parametrize("harm", ["no copy", "copy damaged", "releases unreadable"])
async def test_older_nondum_leaves_alone_what_it_cannot_go_back_from(
    tmp_path: Path, harm: str
) -> None:
    await written(tmp_path, knowing(3, lamp=1))
    with newer_nondum():
        await written(tmp_path, knowing(9, lamp=4))
    copy = Backups(tmp_path / "catalogue.sqlite").of_schema(database.SCHEMA)
    match harm:
        case "no copy":
            copy.unlink()
        case "copy damaged":
            copy.write_bytes(b"\0" * 10_000)
        case _:
            with closing(sqlite3.connect(tmp_path / "catalogue.sqlite")) as connection:
                connection.execute("ALTER TABLE highwater RENAME COLUMN release TO newest")
    with pytest.raises(ConfigRefused) as refused:
        await Catalogue.open(tmp_path / "catalogue.sqlite", "spot")
    assert refused.value.code == "CATALOGUE_VERSION"
    assert revision(tmp_path / "catalogue.sqlite") == 9


@pytest.mark.parametrize("has_copy", [True, False])
async def test_damaged_catalogue_of_an_older_nondum_is_made_of_the_copy_from_before_the_upgrade(
    tmp_path: Path, has_copy: bool
) -> None:
    """The other backups are the newer one's, and know the newest releases."""
    file = tmp_path / "catalogue.sqlite"
    await written(tmp_path, knowing(3, lamp=1))
    with newer_nondum():
        await written(tmp_path, knowing(9, lamp=4))
        Backups(file).make()
    file.write_bytes(b"\0" * 10_000)
    if not has_copy:
        Backups(file).of_schema(database.SCHEMA).unlink()
    catalogue = await Catalogue.open(file, "spot")
    await catalogue.close()
    assert catalogue.state == knowing(3 if has_copy else 0, lamp=4)
    assert catalogue.loss is not None
    assert catalogue.loss.instead is (Instead.BACKUP if has_copy else Instead.NOTHING)


async def test_only_the_copy_of_the_last_upgrade_is_kept(tmp_path: Path) -> None:
    kept = Backups(tmp_path / "catalogue.sqlite")
    await written(tmp_path, knowing(3))
    kept.make_of_schema(database.SCHEMA - 1)
    with newer_nondum():
        await written(tmp_path, knowing(4))
    assert {path.name for path in kept.folder.iterdir()} == {kept.of_schema(database.SCHEMA).name}

"""Copies of the catalogue, for the day on which its file is damaged: the last two are kept; and one
from before an upgrade of nondum, for the day on which that is undone.

SQLite's own backup makes them (sqlite.org/backup.html), from a connection that only reads, so that
no commit waits. Blocking, but for `keep`.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import sqlite3
from collections.abc import Callable, Iterator
from pathlib import Path

from nondum.host.catalogue.database import CACHE
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.store import disk

FOLDER = "backups"
"""Beside the catalogue."""
OF_SCHEMA = "of-schema-"
SETTLED_S = 5.0
"""What changes in so short a time goes into one backup."""

log = logging.getLogger(__name__)


@frozen
class Backups:
    """The copies of one catalogue."""

    catalogue: Path

    @property
    def folder(self) -> Path:
        """Where they are."""
        return self.catalogue.parent / FOLDER

    @property
    def newest(self) -> Path:
        """The last one."""
        return self.folder / "newest.sqlite"

    @property
    def before(self) -> Path:
        """The one before that."""
        return self.folder / "before.sqlite"

    def of_schema(self, schema: int) -> Path:
        """The one from before the upgrade that ended the use of a schema."""
        return self.folder / f"{OF_SCHEMA}{schema}.sqlite"

    def make(self) -> None:
        """Copy the catalogue as it was last committed. Killed at any moment, at least one whole
        copy stays. Raises `sqlite3.Error`, `OSError`."""
        unfinished = self._copied()
        if self.newest.exists():
            self.newest.rename(self.before)
        unfinished.rename(self.newest)
        disk.sync(self.folder)

    def make_of_schema(self, schema: int) -> None:
        """Copy the catalogue before it is brought to another schema; copies of older ones go. If
        that fails, the upgrade takes place all the same."""
        try:
            self._copied().rename(self.of_schema(schema))
            for former in self.folder.glob(f"{OF_SCHEMA}*"):
                if former != self.of_schema(schema):
                    former.unlink()
            disk.sync(self.folder)
        except (sqlite3.Error, OSError) as error:
            log.warning("the catalogue of schema %d is not kept: %s", schema, error)

    def _copied(self) -> Path:
        disk.make_folder(self.folder)
        unfinished = self.folder / ".newest.part"
        unfinished.unlink(missing_ok=True)
        with _reading(self.catalogue, "mode=ro") as source, _writing(unfinished) as target:
            source.backup(target)
        disk.sync(unfinished)
        return unfinished

    def found(self) -> Iterator[Path]:
        """Those that are there and whole, the newest first."""
        for path in (self.newest, self.before, *self.folder.glob(f"{OF_SCHEMA}*")):
            if path.exists() and is_whole(path):
                yield path

    def restore(self, backup: Path) -> None:
        """Put a copy in the catalogue's place, where no file may be any more."""
        disk.write(self.catalogue, backup.read_bytes())


async def keep(
    backups: Backups, revision: Callable[[], object], every_s: float, pace_s: float = SETTLED_S
) -> None:
    """Make a backup whenever `revision` is another, at most every so often, until cancelled."""
    made: object = None
    while True:
        await asyncio.sleep(pace_s)
        if (now := revision()) == made:
            continue
        try:
            await asyncio.to_thread(backups.make)
            made = now
        except (sqlite3.Error, OSError) as error:
            log.warning("no backup of the catalogue could be made: %s", error)
        await asyncio.sleep(max(0.0, every_s - pace_s))


@contextlib.contextmanager
def _reading(path: Path, how: str) -> Iterator[sqlite3.Connection]:
    connection = sqlite3.connect(f"{path.resolve().as_uri()}?{how}", uri=True)
    with contextlib.closing(connection):
        connection.execute(CACHE)
        yield connection


@contextlib.contextmanager
def _writing(path: Path) -> Iterator[sqlite3.Connection]:
    descriptor = os.open(path, os.O_CREAT | os.O_EXCL | os.O_RDWR | os.O_CLOEXEC, 0o600)
    os.close(descriptor)
    connection = sqlite3.connect(path)
    with contextlib.closing(connection):
        connection.execute(CACHE)
        connection.execute("PRAGMA synchronous = OFF")  # it is synced once, when it is whole
        yield connection


def is_whole(path: Path) -> bool:
    """Whether a copy can be used."""
    try:
        # Immutable: nothing writes to it, and SQLite makes no log beside it.
        with _reading(path, "immutable=1") as connection:
            (verdict,) = connection.execute("PRAGMA quick_check(1)").fetchone()
        return bool(verdict == "ok")
    except sqlite3.Error:
        return False

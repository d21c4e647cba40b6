"""Opening the catalogue's file, whatever became of it: as it is, from a backup, or as a new one."""

from __future__ import annotations

import contextlib
import os
import sqlite3
import time
from collections.abc import Mapping
from dataclasses import replace
from enum import Enum
from pathlib import Path

from nondum.host.catalogue import database
from nondum.host.catalogue.backups import Backups, is_whole
from nondum.host.core.state import Highwater, HostState
from nondum.sdk.errors import ConfigRefused, Problem
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.store import disk

TRACES = ("store", "installed")
"""Folders that are filled only after the catalogue was made."""


class Instead(Enum):
    """What took the place of a file that could not be used."""

    BACKUP = "backup"
    """A copy of it."""
    FORMER = "former"
    """A copy from before a newer nondum took it over."""
    MEMORY = "memory"
    """What the running daemon knew."""
    NOTHING = "nothing"
    """An empty one."""


@frozen
class Loss:
    """What became of a file that could not be used."""

    aside: Path | None
    """Where it was moved; None: there was none."""
    instead: Instead
    revision: int = 0
    """Of what took its place."""


@frozen
class Opened:
    """A catalogue's file that is open."""

    connection: sqlite3.Connection
    state: HostState
    loss: Loss | None = None


def open_file(path: Path, host: str) -> Opened:
    """Open the file, made if there is none. A damaged one is set aside; the last whole backup, or
    else an empty one, takes its place. So it is for one that is gone where a host has lived. In the
    place of one that a newer nondum has taken over, there is the copy from before that.

    Raises `ConfigRefused` (CATALOGUE_VERSION, STATE_UNWRITABLE).
    """
    backups = Backups(path)
    try:
        disk.make_folder(path.parent)
        if path.exists() or not _was_there(path, backups):
            opened = _found(path, host, backups)
            if opened is not None:
                return opened
        return _instead(path, host, backups)
    except (OSError, sqlite3.OperationalError) as error:
        raise ConfigRefused(_unwritable(path, error)) from error


def set_aside(path: Path) -> Path | None:
    """Move a file that is of no use out of the way, with its log; where to, if it is there."""
    aside = path.with_name(f"{path.name}.damaged-{time.time_ns()}")
    moved = False
    for suffix in ("", "-wal", "-shm"):
        with contextlib.suppress(FileNotFoundError):
            path.with_name(path.name + suffix).rename(aside.with_name(aside.name + suffix))
            moved = moved or not suffix
    disk.sync(path.parent)
    return aside if moved else None


def _was_there(path: Path, backups: Backups) -> bool:
    """Whether a host has lived in this folder, by what it leaves there beside the catalogue."""
    beside = (path.with_name(name) for name in TRACES)
    return any(backups.found()) or any(one.is_dir() and any(one.iterdir()) for one in beside)


def _found(path: Path, host: str, backups: Backups) -> Opened | None:
    try:
        return _opened(path, host, backups)
    except ConfigRefused as refused:
        return _former(path, host, backups, refused)


def _opened(
    path: Path,
    host: str,
    backups: Backups,
    newest: Mapping[str, Highwater] | None = None,
) -> Opened | None:
    """The file as it is; None: it is damaged, or its content cannot be decoded."""
    try:
        return Opened(*database.opened(path, host, backups.make_of_schema, newest))
    except sqlite3.DatabaseError as error:
        if not database.is_damaged(error):
            raise
        return None


def _instead(path: Path, host: str, backups: Backups) -> Opened:
    aside, newest = set_aside(path), dict[str, Highwater]()
    for backup in backups.found():
        backups.restore(backup)
        try:
            opened = _opened(path, host, backups, newest)
        except ConfigRefused:  # of a newer nondum, which was here before this one
            newest = newest or database.newest_releases(path) or newest
            opened = None
        if opened is not None:
            loss = Loss(aside, Instead.BACKUP, opened.state.revision)
            return Opened(opened.connection, opened.state, loss)
        set_aside(path)
    return Opened(*database.opened(path, host, newest=newest), Loss(aside, Instead.NOTHING))


def _former(path: Path, host: str, backups: Backups, refused: ConfigRefused) -> Opened:
    """The copy of this schema, which knows the newest releases all the same: what was withdrawn or
    replaced under the newer nondum does not come back with the older one. Killed at any moment, one
    of both files is there, whole.

    Raises `refused` if there is no such copy, or those cannot be read.
    """
    backup, newest = backups.of_schema(database.SCHEMA), database.newest_releases(path)
    if newest is None or not (backup.exists() and is_whole(backup)):
        raise refused
    unfinished = path.with_name(f".{path.name}.part")
    unfinished.unlink(missing_ok=True)
    disk.write(unfinished, backup.read_bytes())
    connection, _ = database.opened(unfinished, host, newest=newest)
    connection.close()  # its log is in it now, as the newer one's is since it was read
    aside = path.with_name(f"{path.name}.newer-{time.time_ns()}")
    os.link(path, aside)
    unfinished.rename(path)
    disk.sync(path.parent)
    opened = Opened(*database.opened(path, host))
    return replace(opened, loss=Loss(aside, Instead.FORMER, opened.state.revision))


def problem_of(loss: Loss, installed: tuple[str, ...]) -> Problem:
    """What is told of a loss; `installed` are the payloads that were found in their folders."""
    came = "is gone" if loss.aside is None else "was damaged"
    if loss.instead is Instead.FORMER:
        came = "was a newer nondum's"
    instead = _INSTEAD[loss.instead].format(loss.revision)
    found = f"; found again: {', '.join(installed)}" if installed else ""
    return Problem(
        "CATALOGUE_REBUILT",
        f"the catalogue {came}; {instead}{found}",
        where=str(loss.aside or ""),
        have=_LOST[loss.instead],
        fix="see `nondum status`: install, set or ask for again what is not there",
    )


_INSTEAD = {
    Instead.BACKUP: "a copy of revision {} took its place, and drives are read again",
    Instead.FORMER: "the copy from before the upgrade (revision {}) took its place, and drives are "
    "read again",
    Instead.MEMORY: "what the running daemon knew (revision {}) was written to a new one",
    Instead.NOTHING: "there was no copy of it, so a new one was begun, and drives are read again",
}
_LOST = {
    Instead.BACKUP: "lost: what was told, set and asked for since the copy was made",
    Instead.FORMER: "lost: what was told, set and asked for since the upgrade; releases and trust "
    "are those of today",
    Instead.MEMORY: "lost: the journal until now",
    Instead.NOTHING: "lost: the journal, goals, mounts that people set, releases of payloads that "
    "are not here",
}


def unwritten(path: Path, why: Exception) -> Problem:
    """What is told when a daemon cannot write its catalogue any more."""
    return Problem(
        "CATALOGUE_UNWRITTEN",
        f"the catalogue cannot be written ({why}); what happens now may be forgotten when this "
        "host starts again",
        where=str(path),
        fix="see to it that the disk works and has free space; nondum keeps trying",
    )


def _unwritable(path: Path, error: Exception) -> Problem:
    return Problem(
        "STATE_UNWRITABLE",
        f"the catalogue can neither be read nor made ({error})",
        where=str(path),
        fix="see to it that the disk works, has free space, and that this user may write there",
    )

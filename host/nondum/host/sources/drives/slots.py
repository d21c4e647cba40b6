"""Slots: folders whose entries, real folders or symlinks, stand for drives.

Put an entry there by rename or as a symlink, so that it is whole the moment it appears. One that is
written again where it is, as `payload build` does, is told as inserted again, without having been
removed. What mounts drives by their labels lets strangers name entries: names that cannot be shown
are not read.
"""

from __future__ import annotations

import contextlib
import logging
import os
from collections.abc import Iterator, Sequence
from pathlib import Path

from nondum.host.core.events.drives import DriveInserted, DriveRemoved, DrivesScanned
from nondum.host.core.events.event import Emit
from nondum.host.sources.drives.rebuilt import RebuiltFolders
from nondum.host.sources.inotify import folders_watched
from nondum.host.sources.slot_folders import (
    changed_or_due,
    dead_links,
    is_gone,
    leads_nowhere,
    logged,
    unreadable,
)
from nondum.sdk.errors import Problem

_Identity = tuple[Path, int, str]
"""Path, inode and symlink target: an entry that is replaced is another drive."""
_Slot = tuple[str, _Identity | None]
"""A drive; or the path of a link that leads nowhere yet, without an identity."""

log = logging.getLogger(__name__)


class SlotSource:
    """Watches slot folders; folders that are not there are made."""

    kind = "slot"

    def __init__(self, folders: Sequence[Path]) -> None:
        self._folders = tuple(folders)
        self._seen: dict[str, _Identity] = {}
        self._unread: dict[Path, Problem] = {}
        """Folders and entries that could not be read the last time."""
        self._dangling: dict[Path, Problem] = {}
        """Links that lead nowhere yet."""
        self._rewritten: list[_Slot] = []
        """What is to be told as written again."""

    @property
    def problems(self) -> tuple[Problem, ...]:
        """Of folders that cannot be read, and of links that lead nowhere yet."""
        return (*self._unread.values(), *self._dangling.values())

    async def watch(self, emit: Emit) -> None:
        """Tell what is there, then what comes and goes, until cancelled."""
        with (
            folders_watched(self._folders) as changed,
            contextlib.closing(RebuiltFolders(changed, self._rewritten.append)) as rewritten,
        ):
            self._compare(emit)
            emit(DrivesScanned(self.kind, tuple(self._seen)))
            while True:
                rewritten.look(self._places())
                await changed_or_due(changed, is_unread=bool(self._unread))
                changed.clear()
                self._compare(emit)
                self._tell_rewritten(emit)

    def _places(self) -> dict[_Slot, Path]:
        """What is worth being watched: drives, and links that lead nowhere yet."""
        places: dict[_Slot, Path] = {
            (drive, identity): identity[0] for drive, identity in self._seen.items()
        }
        return places | {(str(link), None): link for link in self._dangling}

    def _tell_rewritten(self, emit: Emit) -> None:
        """Tell of drives that were written again, if they are those that are in still."""
        for drive, identity in self._rewritten:
            if identity is not None and self._seen.get(drive) == identity:
                emit(self._inserted(drive, identity[0]))
        self._rewritten.clear()

    def _compare(self, emit: Emit) -> None:
        """Tell the difference to what was seen last."""
        present = dict(self._entries())
        for drive, identity in list(self._seen.items()):
            if present.get(drive) != identity:
                del self._seen[drive]
                emit(DriveRemoved(drive))
        for drive, identity in present.items():
            if drive not in self._seen:
                self._seen[drive] = identity
                emit(self._inserted(drive, identity[0]))

    def _inserted(self, drive: str, path: Path) -> DriveInserted:
        if path.name.isprintable():
            return DriveInserted(drive, path, self.kind)
        # It is told by the name that can be shown, and nothing is looked for there.
        return DriveInserted(drive, path.parent / drive, self.kind, problems=(_unnameable(drive),))

    def _entries(self) -> Iterator[tuple[str, _Identity]]:
        unread: dict[Path, Problem] = {}
        dangling: dict[Path, Problem] = {}
        for folder in self._folders:
            try:
                entries = _scanned(folder)
                dangling |= _dangling(folder)
            except OSError as error:  # its drives may be in still
                kept = {d: seen for d, seen in self._seen.items() if seen[0].parent == folder}
                unread[folder] = unreadable(folder, error, is_plugged_in=bool(kept))
                dangling |= {at: told for at, told in self._dangling.items() if at.parent == folder}
                yield from kept.items()
                continue
            for entry in entries:
                name = _shown(entry.name)
                drive = name if len(self._folders) == 1 else f"{folder.name}/{name}"
                try:
                    identity = _identity(entry)
                except OSError as error:
                    if is_gone(error):  # it has just gone, or is a link that leads in circles
                        log.debug("%s is no drive: %s", entry.path, error)
                        continue
                    identity, path = self._seen.get(drive), Path(entry.path)
                    is_known = identity is not None
                    unread[path] = unreadable(path, error, is_plugged_in=is_known)
                if identity is not None:
                    yield drive, identity
        self._unread = logged(self._unread, unread)
        self._dangling = dangling


def _scanned(folder: Path) -> list[os.DirEntry[str]]:
    """What is in a slot folder, by name; one that was taken away is empty. Raises `OSError`."""
    try:
        return sorted(os.scandir(folder), key=lambda entry: entry.name)
    except (FileNotFoundError, NotADirectoryError) as error:
        log.warning("the slot folder %s cannot be read: %s", folder, error)
        return []


def _dangling(folder: Path) -> dict[Path, Problem]:
    """Links to what is not there; those to what is are drives, or files. Raises `OSError`."""
    found: dict[Path, Problem] = {}
    for link in dead_links(folder) if folder.is_dir() else ():
        with contextlib.suppress(OSError):  # it has just gone
            found[link] = leads_nowhere(link)
    return found


def _identity(entry: os.DirEntry[str]) -> _Identity | None:
    """What tells a drive from another; None: the entry is none. Raises `OSError`."""
    if entry.name.startswith(".") or not entry.is_dir():
        return None
    target = str(Path(entry.path).readlink()) if entry.is_symlink() else ""
    return Path(entry.path), entry.inode(), target


def _shown(name: str) -> str:
    r"""A name as it is told.

    >>> _shown("stick"), _shown("stick\n")
    ('stick', 'stick\\n')
    """
    return name if name.isprintable() else name.encode("unicode_escape").decode("ascii")


def _unnameable(drive: str) -> Problem:
    return Problem(
        "DRIVE_NAME",
        "its name has characters that cannot be shown, and it is not read",
        where=drive,
        need="letters, digits, blanks and signs, in UTF-8",
        fix="give the drive another label, or mount it under another name",
    )

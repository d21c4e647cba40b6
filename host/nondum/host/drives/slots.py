"""Slots: folders whose entries, real folders or symlinks, stand for drives.

Put an entry there by rename or as a symlink, so that it is whole the moment it appears. One that is
written anew where it is, as `payload build` does, is told as inserted again, without having been
removed. What mounts drives by their labels lets strangers name entries: names that cannot be shown
are not read.
"""

from __future__ import annotations

import contextlib
import logging
import os
from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path

from nondum.host.drives.rewritten import Rewritten
from nondum.host.events import DriveInserted, DriveRemoved, DrivesScanned, Emit
from nondum.host.inotify import folders_watched
from nondum.host.slot_folders import changed_or_due, dead_links, leads_nowhere, unreadable
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
        """Folders that could not be read the last time."""
        self._dangling: tuple[Problem, ...] = ()

    @property
    def problems(self) -> tuple[Problem, ...]:
        """Of folders that cannot be read, and of links that lead nowhere yet."""
        return (*self._unread.values(), *self._dangling)

    async def watch(self, emit: Emit) -> None:
        """Tell what is there, then what comes and goes, until cancelled."""
        compare, again = partial(self._compare, emit), partial(self._again, emit)
        with (
            folders_watched(self._folders) as changed,
            contextlib.closing(Rewritten(changed, compare, again)) as rewritten,
        ):
            compare()
            emit(DrivesScanned(self.kind, tuple(self._seen)))
            while True:
                rewritten.look(self._places())
                await changed_or_due(changed, is_unread=bool(self._unread))
                changed.clear()
                compare()

    def _places(self) -> dict[_Slot, Path]:
        """What is worth being watched: drives, and links that lead nowhere yet."""
        places: dict[_Slot, Path] = {
            (drive, identity): identity[0] for drive, identity in self._seen.items()
        }
        links = [link for folder in self._folders for link in _dead_links(folder)]
        places |= {(str(link), None): link for link in links}
        self._dangling = tuple(_problems(links))
        return places

    def _again(self, emit: Emit, slot: _Slot) -> None:
        """Tell of a drive that was written anew, if it is the one that is in still."""
        self._compare(emit)
        drive, identity = slot
        if identity is not None and self._seen.get(drive) == identity:
            emit(self._inserted(drive, identity[0]))

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
        for folder in self._folders:
            try:
                entries = _scanned(folder)
            except OSError as error:  # its drives may be in still
                if folder not in self._unread:
                    log.warning("the slot folder %s cannot be read: %s", folder, error)
                self._unread[folder] = unreadable(folder, error)
                yield from self._seen_in(folder)
                continue
            self._unread.pop(folder, None)
            for entry in entries:
                try:
                    identity = _identity(entry)
                except OSError as error:  # it has just gone, or is a link that leads in circles
                    log.debug("%s is no drive: %s", entry.path, error)
                    continue
                if identity is not None:
                    name = _shown(entry.name)
                    yield name if len(self._folders) == 1 else f"{folder.name}/{name}", identity

    def _seen_in(self, folder: Path) -> Iterator[tuple[str, _Identity]]:
        return ((d, seen) for d, seen in self._seen.items() if seen[0].parent == folder)


def _scanned(folder: Path) -> list[os.DirEntry[str]]:
    """What is in a slot folder, by name; one that was taken away is empty. Raises `OSError`."""
    try:
        return sorted(os.scandir(folder), key=lambda entry: entry.name)
    except (FileNotFoundError, NotADirectoryError) as error:
        log.warning("the slot folder %s cannot be read: %s", folder, error)
        return []


def _dead_links(folder: Path) -> list[Path]:
    """Links to what is not there; those to what is are drives, or files."""
    with contextlib.suppress(OSError):  # it was told when its entries were read
        return list(dead_links(folder))
    return []


def _problems(links: Iterable[Path]) -> Iterator[Problem]:
    for link in links:
        with contextlib.suppress(OSError):  # it has just gone
            yield leads_nowhere(link)


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

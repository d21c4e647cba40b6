"""Finds slots whose payloads are built again while they are plugged in, or whose folder goes.

An author builds into the folder that is plugged in. What is there is looked at in a thread, for the
entry may be a disk that hangs; such a one keeps others from being looked at again, and nothing else
waits for it.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Generic, TypeAlias, TypeVar

from nondum.host.sources.inotify import CAME, NOT_BY_A_LINK, WATCHED, WENT_ITSELF, Watches
from nondum.sdk.errors import NondumError
from nondum.wheelhouse.format import contents
from nondum.wheelhouse.payload import drive

Stamp: TypeAlias = tuple[int, int, int]
"""Inode, size and time of the last change, in nanoseconds: another one is another file."""
Mark: TypeAlias = frozenset[tuple[str, Stamp, Stamp | None]]
"""Of each payload: its name, its contents list and its signatures. These are written last."""
Looked: TypeAlias = tuple[Mark, int]
"""What was seen, and the time of the latest change of it, in nanoseconds."""

_Slot = TypeVar("_Slot")

log = logging.getLogger(__name__)


class RebuiltFolders(Generic[_Slot]):
    """Looks at what is plugged in, and says what is not as it was. Close it."""

    def __init__(self, changed: asyncio.Event, on_rewritten: Callable[[_Slot], None]) -> None:
        """`changed` is set when it is worth looking again: something has changed, more is watched
        than before, so that nothing that changed meanwhile is missed, or `on_rewritten` was called.
        Raises `OSError`."""
        self._changed = changed
        self._on_rewritten = on_rewritten
        self._watches = Watches(changed)
        self._marks: dict[_Slot, Mark] = {}
        self._since_ns: dict[_Slot, int] = {}
        """When a slot was first asked for."""
        self._is_looking = self._is_wanted = self._is_closed = False

    def look(self, slots: Mapping[_Slot, Path]) -> None:
        """Look at slots, to tell of those that were written again since they were first asked for,
        or looked at last.

        Returns at once. What is asked for while it looks is put off: `changed` is set then.
        """
        for slot in slots:
            self._since_ns.setdefault(slot, time.time_ns())
        if self._is_looking:
            self._is_wanted = True
            return
        if gone := self._since_ns.keys() - slots.keys():
            for slot in gone:
                del self._since_ns[slot]
                self._marks.pop(slot, None)
            self._renew_watches()
        if slots:
            self._is_looking = True
            loop, watches = asyncio.get_running_loop(), self._watches

            def work() -> None:
                found = {slot: _looked(watches, path) for slot, path in slots.items()}
                with contextlib.suppress(RuntimeError):  # the loop has ended meanwhile
                    loop.call_soon_threadsafe(self._found, found)

            try:
                threading.Thread(target=work, name="slots", daemon=True).start()
            except RuntimeError as error:  # no memory for it; the next change asks again
                log.warning("slots are not looked at for what was built into them: %s", error)
                self._is_looking = False

    def _renew_watches(self) -> None:
        """Let go of all watches: some are of what has gone."""
        try:
            fresh = Watches(self._changed)
        except OSError as error:  # they cost a look too many at worst
            log.warning("what has gone from the slots is watched on: %s", error)
            return
        self._watches.close()
        self._watches = fresh

    def close(self) -> None:
        """Watch no more. A look that hangs is left behind."""
        self._is_closed = True
        if not self._is_looking:
            self._watches.close()

    def _found(self, found: Mapping[_Slot, Looked | None]) -> None:
        self._is_looking = False
        if self._is_closed:
            self._watches.close()
            return
        if self._is_wanted:
            self._is_wanted = False
            self._changed.set()
        looked = {slot: one for slot, one in found.items() if one is not None}
        before = {slot: self._marks.get(slot) for slot in looked}
        self._marks |= {slot: mark for slot, (mark, _) in looked.items()}
        if None in before.values():
            self._changed.set()
        for slot, (mark, latest_ns) in looked.items():
            if before[slot] is None:
                is_rewritten = latest_ns > self._since_ns[slot]
            else:
                is_rewritten = before[slot] != mark
            if is_rewritten:
                self._on_rewritten(slot)
                self._changed.set()


def _looked(watches: Watches, slot: Path) -> Looked | None:
    """What is in a slot, watched from before it is looked at; None: it cannot be told."""
    try:
        _watch(watches, slot)
        return _seen(slot)
    except (OSError, NondumError, RuntimeError) as error:  # as of a link that leads in circles
        log.debug("slot %s is not watched: %s", slot, error)
        return None


def _watch(watches: Watches, slot: Path) -> None:
    root = slot.resolve()
    for above in root.parents:
        with contextlib.suppress(FileNotFoundError):
            watches.add(above, WENT_ITSELF)
    if not root.is_dir():
        watches.add(next(above for above in root.parents if above.is_dir()), CAME)
        return
    watches.add(root, WATCHED | WENT_ITSELF)
    inner = WATCHED | NOT_BY_A_LINK
    with contextlib.suppress(FileNotFoundError):
        watches.add(root / drive.FOLDER, inner)
    for folder in drive.find_payloads(root):
        with contextlib.suppress(FileNotFoundError):
            watches.add(folder, inner)


def _seen(slot: Path) -> Looked:
    marks, latest_ns = set(), 0
    for folder in drive.find_payloads(slot) if slot.is_dir() else ():
        paths = (folder, folder / contents.NAME, folder / contents.SIGNATURE_NAME)
        itself, listed, signed = map(_stamp, paths)
        if itself and listed:
            marks.add((folder.name, listed, signed))
            latest_ns = max(latest_ns, itself[-1], listed[-1], signed[-1] if signed else 0)
    return frozenset(marks), latest_ns


def _stamp(path: Path) -> Stamp | None:
    try:
        found = path.stat(follow_symlinks=False)
    except FileNotFoundError:
        return None
    return found.st_ino, found.st_size, found.st_ctime_ns

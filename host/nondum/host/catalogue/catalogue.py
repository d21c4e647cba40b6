"""The catalogue: the host's state as it was last committed, and the journal of how it came to it.

One separate thread does all SQLite work, in the order of the calls, so that a slow disk never stops
the daemon's loop.
"""

from __future__ import annotations

import asyncio
import os
import sqlite3
import time
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import ParamSpec, TypeVar

from nondum.host.catalogue import database, journal, opening
from nondum.host.catalogue.backups import Backups
from nondum.host.catalogue.journal import Since
from nondum.host.catalogue.opening import Instead, Loss, Opened
from nondum.host.catalogue.reserve import Reserve
from nondum.host.core.records.journal import JournalEntry
from nondum.host.core.records.snapshot import Snapshot
from nondum.host.core.shielded import until_done
from nondum.host.core.state import HostState
from nondum.sdk.errors import ConfigRefused, Problem

_P = ParamSpec("_P")
_R = TypeVar("_R")

OWED_LIMIT = 10_000
"""Entries that are kept for a journal that cannot be written; beyond them the oldest are lost."""


class Catalogue:
    """One open catalogue. `close` it."""

    def __init__(
        self, path: Path, opened: Opened, thread: ThreadPoolExecutor, keep: int = journal.KEEP
    ) -> None:
        self._path = path
        self._connection: sqlite3.Connection | None = opened.connection
        """None: the next work on the file makes one. As `_held`, it is the thread's."""
        self._held = opened.state
        """What the file holds."""
        self._state = opened.state
        self._owed: deque[JournalEntry] = deque(maxlen=OWED_LIMIT)
        # What the last daemon left is for recovery only: readers do not see it.
        self._snapshot = Snapshot(opened.state.host, opened.state.revision)
        self._thread = thread
        self._keep = keep
        self._reserve = Reserve(path.with_name("reserve"))
        self.backups = Backups(path)
        self.boot = f"{os.getpid()}-{time.time_ns()}"
        """Names this run of the daemon in the journal."""
        self.loss = opened.loss
        """What became of a file that could not be used, if there was one."""
        self._is_new_file = False
        self._aside: Path | None = None
        """Whether the next file is a new one, and where the last one was moved."""
        self.commits = 0
        """Rises whenever there is more in the journal."""
        self._next = asyncio.Event()
        self.unwritten: Problem | None = None
        """Why the state is newer than what is on disk; None: it is not."""

    @classmethod
    async def open(cls, path: Path, host: str, *, keep: int = journal.KEEP) -> Catalogue:
        """Open the file, or what there is in its place (see `opening`); the journal keeps about
        `keep` entries.

        Raises `ConfigRefused` (CATALOGUE_VERSION, STATE_UNWRITABLE).
        """
        thread = ThreadPoolExecutor(1, thread_name_prefix="catalogue")
        loop = asyncio.get_running_loop()
        opened = await loop.run_in_executor(thread, opening.open_file, path, host)
        catalogue = cls(path, opened, thread, keep)
        await catalogue._run(catalogue._reserve.take)
        return catalogue

    @property
    def state(self) -> HostState:
        """The state last committed, or gone on with."""
        return self._state

    @property
    def revision(self) -> int:
        """Raised whenever components, their devices or mounts change, or what is remembered."""
        return self._state.revision

    def snapshot(self) -> Snapshot:
        """The state last committed, as readers get it; empty until this daemon has recovered."""
        return self._snapshot

    async def commit(self, after: HostState, entries: Sequence[JournalEntry]) -> None:
        """Make `after` the state, in one transaction with the journal entries that tell why, and
        with what is owed.

        A file that proves damaged is replaced by a new one with this state. Raises
        `sqlite3.Error`, `OSError`; then the state is what it was.
        """
        work = asyncio.create_task(self._run(self._write, after, (*self._owed, *entries)))
        try:
            await until_done(work)  # the thread goes on, cancelled or not: what it came to counts
        finally:
            if work.exception() is None:
                self._wrote(after)
        await work

    def hold(self, after: HostState, entries: Sequence[JournalEntry]) -> None:
        """Make `after` the state, in memory only: recovery does the same with it and with the last
        one on disk. The next commit writes it, too."""
        self._owed.extend(entries)
        self._take(after)

    def owe(self, after: HostState, entries: Sequence[JournalEntry], why: Exception) -> None:
        """Continue with a state that cannot be written: the next daemon may not find it.

        The next commit that succeeds writes it, too.
        """
        self._owed.extend(entries)
        self.unwritten = opening.unwritten(self._path, why)
        self._take(after)

    async def journal(
        self,
        *,
        subject: str | None = None,
        after: int = 0,
        since: Since | None = None,
        limit: int = 200,
    ) -> tuple[JournalEntry, ...]:
        """The last entries, oldest first: about one subject, with ids above `after`, not older than
        `since`."""
        return await self._run(self._read_journal, subject, after, since, limit)

    async def changed(self, since: int) -> int:
        """Wait until `commits` is not `since`, and give it."""
        while self.commits == since:
            await self._next.wait()
        return self.commits

    async def close(self) -> None:
        """Finish what was asked for and close the file."""
        await self._run(self._disconnect)
        self._thread.shutdown()

    def _wrote(self, after: HostState) -> None:
        self._owed.clear()
        self.commits += 1
        self._next.set()
        self._next = asyncio.Event()
        self.unwritten = None
        self._take(after)

    def _take(self, after: HostState) -> None:
        self._state = after
        self._snapshot = after.snapshot()

    # On the catalogue's thread

    def _write(self, after: HostState, entries: Sequence[JournalEntry]) -> None:
        """Each cure of what is wrong is tried once."""
        tried: set[Callable[[], bool]] = set()
        while True:
            try:
                database.write(self._connected(), self._held, after, entries, self._keep)
                break
            except (sqlite3.DatabaseError, OSError) as error:
                cure = self._cure_of(error)
                if cure is None or cure in tried or not cure():
                    raise
                tried.add(cure)
        self._held = after
        if self._is_new_file:
            self.loss = Loss(self._aside, Instead.MEMORY, after.revision)
            self._is_new_file, self._aside = False, None
        if self._reserve.release not in tried:
            self._reserve.take()

    def _cure_of(self, error: sqlite3.DatabaseError | OSError) -> Callable[[], bool] | None:
        """What may help; it says whether it has done something."""
        if database.is_damaged(error):
            return self._set_aside
        if database.is_disk_full(error):
            return self._reserve.release
        return self._disconnect if database.is_locked_for_good(error) else None

    def _set_aside(self) -> bool:
        """Have a new file be begun with all that is known."""
        self._disconnect()
        self._aside = opening.set_aside(self._path) or self._aside
        return True

    def _disconnect(self) -> bool:
        if self._connection is not None:
            self._connection.close()
            self._connection = None
        return True

    def _connected(self) -> sqlite3.Connection:
        """The connection. One that is new goes by what it finds: the file may be gone or another
        one. Raises `sqlite3.DatabaseError`, `OSError`."""
        if self._connection is None:
            self._is_new_file = self._is_new_file or not self._path.exists()
            try:
                self._connection, self._held = database.opened(self._path, self._state.host)
            except ConfigRefused as error:  # another nondum's has been put there
                raise database.damaged(str(error)) from error
        return self._connection

    def _read_journal(
        self, subject: str | None, after: int, since: Since | None, limit: int
    ) -> tuple[JournalEntry, ...]:
        return journal.read(self._connected(), subject, after, since, limit)

    async def _run(self, function: Callable[_P, _R], *args: _P.args, **kwargs: _P.kwargs) -> _R:
        def call() -> _R:
            return function(*args, **kwargs)

        return await asyncio.get_running_loop().run_in_executor(self._thread, call)

"""The catalogue: the host's state as it was last committed, and the journal of how it came to it.

All SQLite work happens on one thread of its own, in the order asked for, so that a slow disk never
stops the daemon's loop.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import sqlite3
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import ParamSpec, TypeVar

from nondum.host.catalogue import database
from nondum.host.catalogue.records import JournalEntry, Moment, Snapshot
from nondum.host.catalogue.state import HostState

_P = ParamSpec("_P")
_R = TypeVar("_R")


class Catalogue:
    """One open catalogue. `close` it."""

    def __init__(
        self, connection: sqlite3.Connection, state: HostState, thread: ThreadPoolExecutor
    ) -> None:
        self._connection = connection
        self._state = state
        # What the last daemon left is for recovery only: nobody else sees it.
        self._snapshot = Snapshot(state.host, state.revision)
        self._thread = thread
        self.boot = f"{os.getpid()}-{time.time_ns()}"
        """Names this run of the daemon in the journal."""
        self.set_aside: Path | None = None
        """Where a damaged file was moved, if one was found."""

    @classmethod
    async def open(cls, path: Path, host: str) -> Catalogue:
        """Open the file; a damaged one is set aside beside it and a new one begun."""
        thread = ThreadPoolExecutor(1, thread_name_prefix="catalogue")
        loop = asyncio.get_running_loop()
        connection, aside = await loop.run_in_executor(thread, _connect, path)
        state = await loop.run_in_executor(thread, database.load, connection, host)
        catalogue = cls(connection, state, thread)
        catalogue.set_aside = aside
        return catalogue

    @property
    def state(self) -> HostState:
        """The state last committed."""
        return self._state

    @property
    def revision(self) -> int:
        """Raised whenever components, their devices or mounts change, or what is remembered."""
        return self._state.revision

    def snapshot(self) -> Snapshot:
        """The state last committed, as readers get it; empty until this daemon has recovered."""
        return self._snapshot

    async def commit(self, after: HostState, entries: Sequence[JournalEntry]) -> None:
        """Make `after` the state, in one transaction with the journal entries that tell why."""
        await self._run(database.write, self._connection, self._state, after, entries)
        self._state = after
        self._snapshot = after.snapshot()

    async def journal(
        self, *, subject: str | None = None, after: int = 0, limit: int = 200
    ) -> tuple[JournalEntry, ...]:
        """The last entries, oldest first: about one subject, or with ids above `after`."""
        return await self._run(database.journal, self._connection, subject, after, limit)

    async def close(self) -> None:
        """Finish what was asked for and close the file."""
        await self._run(self._connection.close)
        self._thread.shutdown()

    async def _run(self, function: Callable[_P, _R], *args: _P.args, **kwargs: _P.kwargs) -> _R:
        def call() -> _R:
            return function(*args, **kwargs)

        return await asyncio.get_running_loop().run_in_executor(self._thread, call)


def now() -> Moment:
    """This moment by both clocks."""
    return Moment(time.monotonic(), time.time())


def _connect(path: Path) -> tuple[sqlite3.Connection, Path | None]:
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        return database.connect(path), None
    except sqlite3.DatabaseError as error:
        if not database.is_damaged(error):
            raise
        aside = path.with_name(f"{path.name}.damaged-{time.time_ns()}")
        path.rename(aside)
        for suffix in ("-wal", "-shm"):
            with contextlib.suppress(FileNotFoundError):
                path.with_name(path.name + suffix).rename(aside.with_name(aside.name + suffix))
        return database.connect(path), aside

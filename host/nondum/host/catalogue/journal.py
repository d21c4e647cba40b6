"""The journal's table: appended to with every commit, read from its end, and kept to a length."""

from __future__ import annotations

import sqlite3
from collections.abc import Sequence
from dataclasses import replace

from nondum.host.catalogue import rows
from nondum.host.core.records.journal import JournalEntry
from nondum.host.core.records.moment import Moment
from nondum.sdk.frozen import frozen

KEEP = 20_000
"""Entries that are kept, the last ones, unless the caller sets a number: some eight megabytes."""
KEEP_LEAST = 1000
"""Fewer are never kept; the schema sees to that, too."""
BATCH = 200
"""The oldest entries are deleted in batches of this size."""
PROBLEMS_LIMIT = 50
"""Problems of one entry: a payload may have thousands, and its record has them all."""


@frozen
class Since:
    """A moment in the past, for entries of this run of the daemon and of others.

    For entries of this run the monotonic clock counts, which no one sets: a robot may learn the
    time late.
    """

    boot: str
    at: Moment


def append(connection: sqlite3.Connection, entries: Sequence[JournalEntry], keep: int) -> None:
    """Add entries, and let go of the oldest, within the caller's transaction."""
    last = 0
    for entry in entries:
        row = rows.entry_row(replace(entry, problems=entry.problems[:PROBLEMS_LIMIT]))
        names, marks = ", ".join(row), ", ".join(f":{name}" for name in row)
        statement = f"INSERT INTO journal ({names}) VALUES ({marks})"
        last = connection.execute(statement, rows.storable(row)).lastrowid or 0
    if last:
        _let_go(connection, last - max(keep, KEEP_LEAST))


def read(
    connection: sqlite3.Connection,
    subject: str | None,
    after: int,
    since: Since | None,
    limit: int,
) -> tuple[JournalEntry, ...]:
    """The last `limit` entries with an id above `after`, not older than `since`, oldest first."""
    boot, at = (since.boot, since.at) if since else (None, Moment(0.0, 0.0))
    found = connection.execute(
        "SELECT * FROM journal WHERE id > ? AND (? IS NULL OR subject = ?) "
        "AND (? IS NULL OR CASE boot WHEN ? THEN monotonic_s >= ? ELSE wall_s >= ? END) "
        "ORDER BY id DESC LIMIT ?",
        (after, subject, subject, boot, boot, at.monotonic_s, at.wall_s, limit),
    )
    return tuple(rows.entry(row) for row in reversed(found.fetchall()))


def _let_go(connection: sqlite3.Connection, last: int) -> None:
    """Delete entries up to an id, once they are enough to be worth it."""
    (first,) = connection.execute("SELECT min(id) FROM journal").fetchone()
    if last - first >= BATCH:
        connection.execute("DELETE FROM journal WHERE id <= ?", (last,))

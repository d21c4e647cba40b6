"""The catalogue's SQLite file: opened, checked, read whole, and written by difference. Blocking.

WAL and FULL synchronous: what was committed survives power loss (sqlite.org/wal.html).
"""

from __future__ import annotations

import contextlib
import errno
import os
import sqlite3
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Any

from nondum.host.catalogue import journal, rows
from nondum.host.core.records.component import ComponentRecord
from nondum.host.core.records.journal import JournalEntry
from nondum.host.core.records.payload import Rollback
from nondum.host.core.state import Highwater, HostState
from nondum.sdk.errors import ConfigRefused, NondumError, Problem

SCHEMA = 8

_UPGRADES = {
    1: "CREATE TABLE goals (id TEXT PRIMARY KEY, text TEXT NOT NULL, pddl TEXT NOT NULL,"
    " kind TEXT NOT NULL, priority INTEGER NOT NULL) STRICT;",
    2: "CREATE TABLE former (payload_id TEXT PRIMARY KEY, version TEXT NOT NULL,"
    " components TEXT NOT NULL, left_wall_s REAL NOT NULL) STRICT;",
    3: "ALTER TABLE drives ADD COLUMN mark TEXT NOT NULL DEFAULT '';"
    "ALTER TABLE host ADD COLUMN stopped INTEGER NOT NULL DEFAULT 0;"
    "CREATE TABLE tries (subject TEXT PRIMARY KEY, deaths INTEGER NOT NULL) STRICT;"
    "INSERT INTO tries SELECT key, attempts FROM payloads WHERE attempts > 0;"
    "ALTER TABLE payloads DROP COLUMN attempts;"
    "ALTER TABLE payloads ADD COLUMN was INTEGER NOT NULL DEFAULT 0;"
    "CREATE TABLE rollbacks (fleet TEXT NOT NULL, payload_id TEXT NOT NULL, digest TEXT NOT NULL,"
    " release INTEGER NOT NULL, below INTEGER NOT NULL, PRIMARY KEY (fleet, payload_id)) STRICT;"
    "ALTER TABLE highwater ADD COLUMN owner TEXT NOT NULL DEFAULT '';"
    "DROP TRIGGER journal_is_never_deleted;"
    "CREATE TRIGGER journal_is_never_deleted BEFORE DELETE ON journal"
    " WHEN old.id > (SELECT max(id) FROM journal) - 1000"
    " BEGIN SELECT RAISE(ABORT, 'the journal is append-only'); END;",
    # Every daemon that starts reads the devices again.
    4: "UPDATE claims SET device = NULL; DROP TABLE devices;"
    "ALTER TABLE claims ADD COLUMN nodes TEXT NOT NULL DEFAULT '[]';"
    "CREATE TABLE devices (id TEXT PRIMARY KEY, bus TEXT NOT NULL, port TEXT NOT NULL,"
    " parent TEXT NOT NULL, driver TEXT NOT NULL, vendor TEXT NOT NULL, product TEXT NOT NULL,"
    " serial TEXT NOT NULL, name TEXT NOT NULL, first_s REAL NOT NULL, since_s REAL NOT NULL)"
    " STRICT;"
    "CREATE TABLE device_interfaces (device TEXT NOT NULL REFERENCES devices (id) ON DELETE"
    " CASCADE, position INTEGER NOT NULL, number TEXT NOT NULL, kind TEXT NOT NULL,"
    " driver TEXT NOT NULL, PRIMARY KEY (device, position)) STRICT;"
    "CREATE TABLE device_nodes (device TEXT NOT NULL REFERENCES devices (id) ON DELETE CASCADE,"
    " position INTEGER NOT NULL, node TEXT NOT NULL, interface TEXT NOT NULL,"
    " properties TEXT NOT NULL, PRIMARY KEY (device, position)) STRICT;"
    "CREATE TABLE known_devices (identity TEXT PRIMARY KEY, name TEXT NOT NULL,"
    " device TEXT NOT NULL, first_s REAL NOT NULL, last_s REAL NOT NULL) STRICT;",
    # Releases of one payload were told apart by fleets: now the highest counts for all of them.
    5: "CREATE TABLE highest (payload_id TEXT PRIMARY KEY, release INTEGER NOT NULL,"
    " digest TEXT NOT NULL, owner TEXT NOT NULL) STRICT;"
    "INSERT INTO highest SELECT payload_id, release, digest, coalesce((SELECT first.owner"
    " FROM highwater AS first WHERE first.payload_id = known.payload_id AND first.owner <> ''"
    " ORDER BY first.rowid LIMIT 1), '') FROM (SELECT *, row_number() OVER (PARTITION BY payload_id"
    " ORDER BY release DESC, rowid) AS place FROM highwater) AS known WHERE place = 1;"
    "DROP TABLE highwater; ALTER TABLE highest RENAME TO highwater;"
    "CREATE TABLE latest (payload_id TEXT PRIMARY KEY, digest TEXT NOT NULL,"
    " release INTEGER NOT NULL, below INTEGER NOT NULL) STRICT;"
    "INSERT OR REPLACE INTO latest SELECT payload_id, digest, release, below FROM rollbacks"
    " ORDER BY rowid;"
    "DROP TABLE rollbacks; ALTER TABLE latest RENAME TO rollbacks;",
    6: "CREATE TABLE connections (input TEXT PRIMARY KEY, stream TEXT NOT NULL) STRICT;",
    7: "CREATE TABLE names (payload_id TEXT PRIMARY KEY, components TEXT NOT NULL,"
    " plugins TEXT NOT NULL) STRICT;"
    "ALTER TABLE payloads DROP COLUMN waits_for;"
    "ALTER TABLE payloads ADD COLUMN renamed TEXT NOT NULL DEFAULT '{}';",
}
"""Schema → what makes the next one of it."""

CACHE = "PRAGMA cache_size = -512"
"""What a connection keeps of the file: 512 KiB, not SQLite's 2 MB. The kernel has all of it."""
_PRAGMAS = (
    CACHE,
    "PRAGMA journal_mode = WAL",
    "PRAGMA synchronous = FULL",
    "PRAGMA foreign_keys = ON",
    "PRAGMA trusted_schema = OFF",
    "PRAGMA busy_timeout = 5000",
)


_UNREADABLE = (sqlite3.DatabaseError, NondumError, LookupError, TypeError, ValueError)
"""What is raised for a file whose rows cannot be parsed."""

MODE = 0o600
"""Of the file: it holds the journal, goals and serial numbers, for no other user to read."""


def connect(
    path: Path, before_upgrade: Callable[[int], None] = lambda schema: None
) -> sqlite3.Connection:
    """Open the file, made if it is not there. One of an older schema is brought to this one; before
    that, `before_upgrade` is called with its own.

    Raises `sqlite3.DatabaseError` (see `is_damaged`) and `ConfigRefused` (CATALOGUE_VERSION).
    """
    with contextlib.suppress(FileExistsError):  # SQLite gives its other files the mode of this one
        os.close(os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY | os.O_CLOEXEC, MODE))
    path.chmod(MODE)
    connection = sqlite3.connect(path, isolation_level=None, check_same_thread=False)
    try:
        connection.row_factory = sqlite3.Row
        for pragma in _PRAGMAS:
            connection.execute(pragma)
        (verdict,) = connection.execute("PRAGMA quick_check(1)").fetchone()
        if verdict != "ok":
            raise damaged(verdict)
        _prepare(connection, before_upgrade)
    except BaseException:
        connection.close()
        raise
    return connection


def opened(
    path: Path,
    host: str,
    before_upgrade: Callable[[int], None] = lambda schema: None,
    newest: Mapping[str, Highwater] | None = None,
) -> tuple[sqlite3.Connection, HostState]:
    """Open the file and read all of it but the journal. Releases of payloads in `newest` that are
    newer than what it knows are written into it first.

    Raises `sqlite3.DatabaseError` (`is_damaged` is true for it also if a row cannot be parsed) and
    `ConfigRefused` (CATALOGUE_VERSION).
    """
    connection = connect(path, before_upgrade)
    try:
        _raise_highwater(connection, newest or {})
        return connection, load(connection, host)
    except BaseException as error:
        connection.close()
        if isinstance(error, sqlite3.OperationalError) or is_damaged(error):
            raise
        if isinstance(error, _UNREADABLE):
            raise damaged(str(error)) from error
        raise


def is_damaged(error: BaseException) -> bool:
    """Whether the file itself is damaged; a disk that is unreachable or full does not count."""
    return _code(error) in (sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB)


def is_disk_full(error: Exception) -> bool:
    """Whether a full disk may be the cause: SQLite reports some full disks as I/O errors."""
    is_full = isinstance(error, OSError) and error.errno == errno.ENOSPC
    return is_full or _code(error) in (sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR)


def is_locked_for_good(error: Exception) -> bool:
    """Whether a lock of the write-ahead log could not be let go of: it is held until all of the
    process's connections are closed."""
    return _code(error) == sqlite3.SQLITE_PROTOCOL


def _code(error: BaseException) -> int:
    """SQLite's primary result code; 0 where there is none."""
    return getattr(error, "sqlite_errorcode", 0) & 0xFF


def damaged(verdict: str) -> sqlite3.DatabaseError:
    """The error of a file that is broken."""
    error = sqlite3.DatabaseError(verdict)
    error.sqlite_errorcode = sqlite3.SQLITE_CORRUPT
    return error


def newest_releases(path: Path) -> dict[str, Highwater] | None:
    """Payload → its newest release, as a file of any schema has it; None: it cannot be read."""
    try:
        with contextlib.closing(sqlite3.connect(path)) as connection:
            connection.row_factory = sqlite3.Row
            found = connection.execute("SELECT * FROM highwater").fetchall()
            return {row["payload_id"]: rows.highwater(row) for row in found}
    except _UNREADABLE:
        return None


def _raise_highwater(connection: sqlite3.Connection, newest: Mapping[str, Highwater]) -> None:
    known = {
        row["payload_id"]: rows.highwater(row)
        for row in connection.execute("SELECT * FROM highwater")
    }
    for payload_id, one in newest.items():
        if payload_id not in known or known[payload_id].release < one.release:
            row = {"payload_id": payload_id, **rows.highwater_row(one)}
            _insert(connection, "highwater", row)


def _prepare(connection: sqlite3.Connection, before_upgrade: Callable[[int], None]) -> None:
    (version,) = connection.execute("PRAGMA user_version").fetchone()
    if version in _UPGRADES:
        before_upgrade(version)
    while version in _UPGRADES:
        _run_script(connection, _UPGRADES[version], version + 1)
        version += 1
    if version == SCHEMA:
        return
    if version != 0:
        raise ConfigRefused(
            Problem(
                "CATALOGUE_VERSION",
                "the catalogue was written by another version of nondum",
                need=f"schema {SCHEMA}",
                have=f"schema {version}",
                fix="run the nondum that wrote it, or move the file away",
            )
        )
    script = resources.files(__package__).joinpath("schema.sql").read_text(encoding="utf-8")
    _run_script(connection, script, SCHEMA)


def _run_script(connection: sqlite3.Connection, script: str, version: int) -> None:
    """Bring the file to a schema, or leave it as it was."""
    connection.executescript(f"BEGIN IMMEDIATE; {script} PRAGMA user_version = {version}; COMMIT;")


def load(connection: sqlite3.Connection, host: str) -> HostState:
    """Read all of it but the journal."""

    def every(table: str, order: str = "rowid") -> list[sqlite3.Row]:
        return connection.execute(f"SELECT * FROM {table} ORDER BY {order}").fetchall()

    sources = _grouped(every("sources", "position"), "payload")
    claims = _grouped(every("claims", "position"), "component")
    interfaces = _grouped(every("device_interfaces", "position"), "device")
    nodes = _grouped(every("device_nodes", "position"), "device")
    devices = [
        rows.device(row, interfaces.get(row["id"], ()), nodes.get(row["id"], ()))
        for row in every("devices")
    ]
    payloads = [rows.payload(row, sources.get(row["key"], ())) for row in every("payloads")]
    components = [rows.component(row, claims.get(row["id"], ())) for row in every("components")]
    found = connection.execute("SELECT revision, stopped FROM host").fetchone()
    return HostState(
        host=host,
        revision=found["revision"] if found else 0,
        drives={d.id: d for d in map(rows.drive, every("drives"))},
        payloads={p.key: p for p in payloads},
        components={c.id: c for c in components},
        devices={d.id: d for d in devices},
        known_devices={
            known.identity: known for known in map(rows.known_device, every("known_devices"))
        },
        mounts={m.unit: m for m in map(rows.mount, every("mounts"))},
        connections={row["input"]: row["stream"] for row in every("connections")},
        goals={g.id: g for g in map(rows.goal, every("goals"))},
        former={f.key: f for f in map(rows.former, every("former")) if f is not None},
        highwater={row["payload_id"]: rows.highwater(row) for row in every("highwater")},
        names={row["payload_id"]: rows.names(row) for row in every("names")},
        rollbacks={
            row["payload_id"]: Rollback(row["digest"], row["release"], row["below"])
            for row in every("rollbacks")
        },
        tries={row["subject"]: row["deaths"] for row in every("tries")},
        is_stopped=bool(found["stopped"]) if found else False,
    )


def _grouped(parts: list[sqlite3.Row], owner: str) -> dict[str, list[sqlite3.Row]]:
    """Rows by whose they are, in their order."""
    groups: dict[str, list[sqlite3.Row]] = {}
    for part in parts:
        groups.setdefault(part[owner], []).append(part)
    return groups


def write(
    connection: sqlite3.Connection,
    before: HostState,
    after: HostState,
    entries: Sequence[JournalEntry],
    keep: int = journal.KEEP,
) -> None:
    """Commit, at once, the difference of two states and the journal entries that tell of it.

    The journal keeps about `keep` entries.
    """
    connection.execute("BEGIN IMMEDIATE")
    try:
        _write_state(connection, before, after)
        journal.append(connection, entries, keep)
        connection.execute("COMMIT")
    except BaseException:
        if connection.in_transaction:  # SQLite ends it by itself when a disk is full
            connection.execute("ROLLBACK")
        raise


def _write_state(connection: sqlite3.Connection, before: HostState, after: HostState) -> None:
    if _host_row(before) != _host_row(after):
        connection.execute("DELETE FROM host")
        _insert(connection, "host", _host_row(after))
    simple: Iterable[tuple[str, str, Any, Any, Callable[[Any], rows.Row]]] = (
        ("drives", "id", before.drives, after.drives, rows.drive_row),
        ("mounts", "unit", before.mounts, after.mounts, rows.mount_row),
        (
            *("known_devices", "identity"),
            *(before.known_devices, after.known_devices, rows.known_device_row),
        ),
        ("goals", "id", before.goals, after.goals, rows.goal_row),
        ("former", "payload_id", before.former, after.former, rows.former_row),
        ("tries", "subject", _try_counts(before), _try_counts(after), _try_row),
        ("connections", "input", _connections(before), _connections(after), _connection_row),
    )
    for table, key, old, new, as_row in simple:
        _difference(connection, table, key, old, new, as_row)
    for payload_id, newest in after.highwater.items():
        if before.highwater.get(payload_id) != newest:
            _insert(
                connection, "highwater", {"payload_id": payload_id, **rows.highwater_row(newest)}
            )
    _write_rollbacks(connection, before, after)
    _write_names(connection, before, after)
    _difference(connection, "payloads", "key", before.payloads, after.payloads, rows.payload_row)
    for payload in _changed(before.payloads, after.payloads):
        _replace_parts(connection, "sources", "payload", payload.key, rows.source_rows(payload))
    _write_components(connection, before, after)


def _write_rollbacks(connection: sqlite3.Connection, before: HostState, after: HostState) -> None:
    """All of them: there are few, and they seldom change."""
    if before.rollbacks == after.rollbacks:
        return
    connection.execute("DELETE FROM rollbacks")
    for payload_id, back in after.rollbacks.items():
        row = {"digest": back.digest, "release": back.release, "below": back.below}
        _insert(connection, "rollbacks", {"payload_id": payload_id, **row})


def _write_names(connection: sqlite3.Connection, before: HostState, after: HostState) -> None:
    for payload_id in before.names.keys() - after.names.keys():
        connection.execute("DELETE FROM names WHERE payload_id = ?", (payload_id,))
    for payload_id, names in after.names.items():
        if before.names.get(payload_id) != names:
            _insert(connection, "names", rows.names_row(payload_id, names))


def _host_row(state: HostState) -> rows.Row:
    return {"name": state.host, "revision": state.revision, "stopped": int(state.is_stopped)}


def _try_counts(state: HostState) -> dict[str, tuple[str, int]]:
    return {subject: (subject, deaths) for subject, deaths in state.tries.items()}


def _try_row(one: tuple[str, int]) -> rows.Row:
    subject, deaths = one
    return {"subject": subject, "deaths": deaths}


def _connections(state: HostState) -> dict[str, tuple[str, str]]:
    return {name: (name, stream) for name, stream in state.connections.items()}


def _connection_row(one: tuple[str, str]) -> rows.Row:
    name, stream = one
    return {"input": name, "stream": stream}


def _write_components(connection: sqlite3.Connection, before: HostState, after: HostState) -> None:
    """Devices around components: a claim refers to both."""
    changed: list[ComponentRecord] = _changed(before.components, after.components)
    gone = before.components.keys() - after.components.keys()
    for id in sorted({*gone, *(component.id for component in changed)}):
        connection.execute("DELETE FROM claims WHERE component = ?", (id,))
    _difference(connection, "devices", "id", before.devices, after.devices, rows.device_row)
    for device in _changed(before.devices, after.devices):
        interfaces, nodes = rows.interface_rows(device), rows.node_rows(device)
        _replace_parts(connection, "device_interfaces", "device", device.id, interfaces)
        _replace_parts(connection, "device_nodes", "device", device.id, nodes)
    _difference(
        connection, "components", "id", before.components, after.components, rows.component_row
    )
    for component in changed:
        _replace_parts(connection, "claims", "component", component.id, rows.claim_rows(component))


def _changed(before: Mapping[str, Any], after: Mapping[str, Any]) -> list[Any]:
    return [value for key, value in after.items() if before.get(key) != value]


def _difference(
    connection: sqlite3.Connection,
    table: str,
    key: str,
    before: Mapping[str, Any],
    after: Mapping[str, Any],
    as_row: Callable[[Any], rows.Row],
) -> None:
    for gone in before.keys() - after.keys():
        connection.execute(f"DELETE FROM {table} WHERE {key} = ?", (gone,))
    for value in _changed(before, after):
        _upsert(connection, table, key, as_row(value))


def _replace_parts(
    connection: sqlite3.Connection, table: str, owner: str, id: str, parts: list[rows.Row]
) -> None:
    connection.execute(f"DELETE FROM {table} WHERE {owner} = ?", (id,))
    for part in parts:
        _insert(connection, table, part)


def _insert(connection: sqlite3.Connection, table: str, row: rows.Row) -> None:
    names, marks = ", ".join(row), ", ".join(f":{name}" for name in row)
    statement = f"INSERT OR REPLACE INTO {table} ({names}) VALUES ({marks})"
    connection.execute(statement, rows.storable(row))


def _upsert(connection: sqlite3.Connection, table: str, key: str, row: rows.Row) -> None:
    """Not REPLACE, which deletes the old row first and, by cascade, all that refers to it."""
    names, marks = ", ".join(row), ", ".join(f":{name}" for name in row)
    updates = ", ".join(f"{name} = excluded.{name}" for name in row if name != key)
    connection.execute(
        f"INSERT INTO {table} ({names}) VALUES ({marks}) "
        f"ON CONFLICT ({key}) DO UPDATE SET {updates}",
        rows.storable(row),
    )

"""What payloads have on a machine through a host: processes, mounts, folders and rows."""

from __future__ import annotations

import contextlib
import json
import select
import sqlite3
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from tests.kit.descendants import pids

from nondum.host.sandbox.helper.mountinfo import mounted_below

FOLDERS = ("staging", "payloads", "venvs", "scratch", "mounts")
LASTING = {"host", "highwater", "former", "journal"}
"""Tables that outlive payloads; `former_payloads` says what is in that of former ones."""


@dataclass(frozen=True)
class Traces:
    """Two of them are equal when nothing came and nothing stayed."""

    workers: tuple[str, ...]
    """Scratch folder of each process that a worker is or has started, whosever child it is."""
    opened: tuple[str, ...]
    """Files on drives that any process has open."""
    mounts: tuple[Path, ...]
    folders: tuple[str, ...]
    rows: tuple[tuple[str, tuple[object, ...]], ...]
    """Rows of the catalogue, but for what outlives payloads."""

    @classmethod
    def of(cls, state: Path, drives: Path) -> Traces:
        """Look for them: `state` is the host's state folder, `drives` where its drives lie."""
        return cls(
            tuple(sorted(folder for _, folder in workers(state))),
            tuple(sorted(_open(drives))),
            tuple(mounted_below(state)),
            tuple(sorted(_folders(state))),
            tuple(_rows(state / "catalogue.sqlite")),
        )


def former_payloads(state: Path) -> dict[str, set[str]]:
    """Payload id → components, of the payloads that a host remembers: all that is meant to stay."""
    with _catalogue(state / "catalogue.sqlite") as connection:
        rows = connection.execute("SELECT payload_id, components FROM former")
        return {id: set(json.loads(components)) for id, components in rows}


def workers(state: Path) -> Iterator[tuple[int, str]]:
    """Processes of workers of a host, by what their environment says: pid and scratch folder."""
    for pid in pids():
        with contextlib.suppress(OSError):
            variables = Path(f"/proc/{pid}/environ").read_bytes().split(b"\0")
            for variable in variables:
                name, _, value = variable.decode(errors="replace").partition("=")
                if name == "NONDUM_WORKER" and value.startswith(str(state)):
                    yield pid, value


def until_unmounted(folder: Path, timeout_s: float = 60.0) -> None:
    """Wait until nothing is mounted below a folder. Raises `TimeoutError`."""
    with Path("/proc/self/mountinfo").open() as changes:  # see proc(5): polls as an exception
        poll = select.poll()
        poll.register(changes, select.POLLPRI)
        while mounted_below(folder):
            if not poll.poll(timeout_s * 1000):
                raise TimeoutError(f"still mounted: {mounted_below(folder)}")
            changes.seek(0)
            changes.read()


def _open(folder: Path) -> Iterator[str]:
    for pid in pids():
        with contextlib.suppress(OSError):
            for descriptor in Path(f"/proc/{pid}/fd").iterdir():
                with contextlib.suppress(OSError):
                    if str(target := descriptor.readlink()).startswith(f"{folder}/"):
                        yield str(target)


def _folders(state: Path) -> Iterator[str]:
    for name in FOLDERS:
        yield from (str(path.relative_to(state)) for path in state.glob(f"{name}/*"))


def _rows(catalogue: Path) -> Iterator[tuple[str, tuple[object, ...]]]:
    with _catalogue(catalogue) as connection:
        names = connection.execute("SELECT name FROM sqlite_master WHERE type = 'table'")
        for (table,) in sorted(names.fetchall()):
            if table not in LASTING and not table.startswith("sqlite_"):
                for row in sorted(connection.execute(f"SELECT * FROM {table}"), key=repr):
                    yield table, tuple(row)


def _catalogue(file: Path) -> contextlib.closing[sqlite3.Connection]:
    return contextlib.closing(sqlite3.connect(f"file:{file}?mode=ro", uri=True))

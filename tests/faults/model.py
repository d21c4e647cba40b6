"""What must hold of a host's state folder after a daemon came to its end, however it did.

`look` judges what lies there, while no daemon runs; `recover_twice` what a start makes of it;
`bring_to_an_end` lets a daemon live on it, and go on until nothing is plugged in.
"""

from __future__ import annotations

import asyncio
import contextlib
import sqlite3
import time
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from tests.faults.daemon import HOST, OPTIONS, QUICK
from tests.faults.ways import let_start
from tests.kit.host import HostInProcess, host_in_process, left_over
from tests.kit.until import until

from nondum.host.catalogue.catalogue import Catalogue
from nondum.host.core.clock import now
from nondum.host.core.events.payloads import RetryAsked
from nondum.host.core.records.drive import DriveState
from nondum.host.core.records.step import Step
from nondum.host.lifecycle.recovery import recover
from nondum.host.manager.state_folders import Folders, missing, sweep
from nondum.host.sandbox.helper.mountinfo import mounted_below
from nondum.wheelhouse.store.store import Store

ENDED_S = 5.0
"""So long processes may take to follow their daemon."""

VOLATILE = frozenset({"journal", "tries", "host", "sqlite_sequence"})
"""Tables that another start changes: it is written down, and counted."""


@dataclass(frozen=True)
class Told:
    """What a daemon told of, in the file `told`."""

    boot: str = ""
    entries: int = 0
    """Journal entries whose commit was acknowledged."""
    revision: int = 0

    @classmethod
    def of(cls, root: Path, log: int | None = None) -> list[Told]:
        """The last words of every daemon that lived there, as long as the disk's log was no longer
        than that."""
        last: dict[str, Told] = {}
        with contextlib.suppress(FileNotFoundError):
            for line in (root / "told").read_text().splitlines():
                what, *words = line.split()
                if what == "committed" and (log is None or int(words[3]) <= log):
                    last[words[0]] = cls(words[0], int(words[1]), int(words[2]))
        return list(last.values())


def look(root: Path, told: list[Told]) -> Iterator[str]:
    """What is wrong with what lies there: mounts and the catalogue. Processes are waited for."""
    until_none_of(root)
    state = root / "state"
    if mounted := mounted_below(state):
        yield f"left mounted: {mounted}"
    if (state / "catalogue.sqlite").exists():
        yield from _look_at_catalogue(state / "catalogue.sqlite", told)
    elif any(one.entries for one in told):
        yield "the catalogue is gone"


def _look_at_catalogue(file: Path, told: list[Told]) -> Iterator[str]:
    with contextlib.closing(sqlite3.connect(file)) as connection:
        (verdict,) = connection.execute("PRAGMA integrity_check").fetchone()
        if verdict != "ok":
            yield f"integrity: {verdict}"
        if wrong := connection.execute("PRAGMA foreign_key_check").fetchall():
            yield f"foreign keys: {wrong}"
        for one in told:
            counting = "SELECT count(*) FROM journal WHERE boot = ?"
            (count,) = connection.execute(counting, (one.boot,)).fetchone()
            if count < one.entries:
                yield f"{one.boot} acknowledged {one.entries} entries, {count} are there"
        newest = max((one.revision for one in told), default=0)
        if not newest:
            return
        (revision,) = connection.execute("SELECT max(revision) FROM host").fetchone()
        if (revision or 0) < newest:
            yield f"acknowledged revision {newest}, have {revision}"


def until_none_of(root: Path) -> None:
    """Wait until no process belongs to a daemon of that root. Raises `TooLate`."""
    what = f"no process of {root}"
    left = partial(processes_of, root)
    until(what, lambda: not left(), evidence=left, patience_s=ENDED_S)


def processes_of(folder: Path) -> list[str]:
    """Processes whose environment names a folder, as that of workers names their scratch."""
    name = str(folder).encode()

    def is_there(value: bytes) -> bool:
        return value == name or value.startswith(name + b"/")

    found = []
    for process in Path("/proc").iterdir():
        if not process.name.isdigit():
            continue
        try:
            said = (process / "environ").read_bytes()
            words = (process / "cmdline").read_text().replace("\0", " ")
        except OSError:
            continue
        if any(is_there(v.partition(b"=")[2]) for v in said.split(b"\0")):
            found.append(words)
    return found


async def recover_twice(root: Path) -> list[str]:
    """Start up twice as far as a daemon's recovery goes: the second must find nothing to do."""
    first, _ = await _recovered(root)
    second, swept = await _recovered(root)
    wrong = []
    if first != second:
        wrong.append(f"recovery came to something else the second time: {first ^ second}")
    if swept:
        wrong.append(f"the second sweep found {swept}")
    return wrong


async def _recovered(root: Path) -> tuple[frozenset[str], list[Path]]:
    """What the catalogue and the folders hold after recovery; what the sweep took away."""
    folders = Folders(root / "state")
    catalogue = await Catalogue.open(folders.catalogue, HOST)
    try:
        state = recover(catalogue.state, now(), missing(folders, catalogue.state)).state
        await catalogue.commit(state, ())
        swept = [*sweep(folders, state), *Store(folders.store).sweep()]
    finally:
        await catalogue.close()
    with contextlib.closing(sqlite3.connect(folders.catalogue)) as connection:
        tables = connection.execute("SELECT name FROM sqlite_master WHERE type = 'table'")
        names = [name for (name,) in tables.fetchall() if name not in VOLATILE]
        rows = {
            f"{name}: {row}"
            for name in names
            for row in connection.execute(f"SELECT * FROM {name}")
        }
    files = {str(path.relative_to(folders.root)) for path in folders.root.glob("*/*")}
    return frozenset(rows | files), swept


@dataclass(frozen=True)
class Ended:
    """How a daemon fared that came after."""

    restart_s: float
    """From its start until it had recovered."""
    steps: dict[str, Step]
    """Payload version → the step it was at before it was pulled."""
    codes: tuple[str, ...]
    """Of what was refused before another try."""
    wrong: tuple[str, ...]


async def bring_to_an_end(root: Path) -> Ended:
    """Start a daemon, wait until all is settled, ask for another try where something was refused,
    pull everything, and see that nothing is left."""
    begun = time.monotonic()
    wrong: list[str] = []
    let_start(root)
    async with host_in_process(root, options=OPTIONS, timing=QUICK) as host:
        restart_s = time.monotonic() - begun
        await until_settled(host)
        refused = [p for p in host.snapshot.payloads if p.problems]
        for payload in refused:
            host.heard.clear()
            host.bus.emit(RetryAsked(payload.key))
            await host.until(lambda: any(isinstance(e, RetryAsked) for e in host.heard))
            await until_settled(host)
        steps = {payload.version: payload.step for payload in host.snapshot.payloads}
        for slot in host.slots.iterdir():
            slot.unlink()
        await host.until(lambda: not host.snapshot.drives and not host.snapshot.payloads)
        if host.snapshot.components:
            wrong.append("components are left")
        if left := left_over(host.folders):
            wrong.append(f"left over: {left}")
    wrong += look(root, [])
    if parts := list((root / "state/store").glob(".*")):
        wrong.append(f"half done in the store: {parts}")
    codes = tuple(problem.code for payload in refused for problem in payload.problems)
    return Ended(restart_s, steps, codes, tuple(wrong))


async def until_settled(host: HostInProcess) -> None:
    """Wait until every drive was read and every payload is where it stays."""
    at_rest = {Step.ACTIVE, Step.SUPERSEDED, Step.REFUSED, Step.QUARANTINED}

    def is_settled() -> bool:
        return (
            {path.name for path in host.slots.iterdir()} == {d.id for d in host.snapshot.drives}
            and all(drive.state is DriveState.IDLE for drive in host.snapshot.drives)
            and all(payload.step in at_rest for payload in host.snapshot.payloads)
        )

    await host.until(is_settled)


def check(root: Path, told: list[Told] | None = None) -> Ended:
    """All of it, one after the other; `told`: what must be there, if not all that was told."""
    wrong = [*look(root, Told.of(root) if told is None else told)]
    wrong += asyncio.run(recover_twice(root))
    ended = asyncio.run(bring_to_an_end(root))
    return Ended(ended.restart_s, ended.steps, ended.codes, (*wrong, *ended.wrong))

"""The catalogue keeps what was committed, and tells how it came to it."""

from __future__ import annotations

import asyncio
import contextlib
import sqlite3
from collections.abc import AsyncIterator, Callable
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from tests.kit.descriptors import descriptors_left

from nondum.host.catalogue import database, journal
from nondum.host.catalogue.catalogue import Catalogue
from nondum.host.catalogue.journal import Since
from nondum.host.catalogue.opening import Instead
from nondum.host.catalogue.rows import as_json
from nondum.host.core.records.component import ComponentRecord, ComponentState
from nondum.host.core.records.device import (
    DeviceClaim,
    DeviceInterface,
    DeviceNode,
    DeviceRecord,
    KnownDevice,
)
from nondum.host.core.records.drive import DriveRecord, DriveState
from nondum.host.core.records.goal import GoalRecord
from nondum.host.core.records.journal import JournalEntry
from nondum.host.core.records.moment import Moment
from nondum.host.core.records.mount import MountPose
from nondum.host.core.records.payload import FormerPayload, PayloadRecord, Rollback
from nondum.host.core.records.step import Step
from nondum.host.core.state import Highwater, HostState
from nondum.planning.merge.given_names import GivenNames
from nondum.sdk.description import (
    Behaviour,
    Fragment,
    Label,
    Output,
    Phrase,
    PluginDescription,
    Unit,
)
from nondum.sdk.errors import ConfigRefused, Problem

AT = Moment(1.5, 1_700_000_000.25)
PROBLEM = Problem("TEST", "made up, mit ß", where="here", need="1", have="0", fix="none")

EYE = PluginDescription(
    name="eye",
    version="2.0",
    summary="Sees",
    behaviours=(Behaviour("stream", "(stream ?u - camera)", True, ("look",), "Sees."),),
    fragments=(Fragment("domain.pddl", "(define (domain eye))"),),
    units=(Unit("camera", "camera", (Output("video", "image"),)),),
    phrases=(Phrase("look at {t:target}", "(seen ?t)"),),
    labels=(Label("lamp", "the lamp"),),
)


def payload(key: str = "k1", step: Step = Step.ACTIVE) -> PayloadRecord:
    return PayloadRecord(
        key=key,
        digest=f"digest-{key}",
        payload_id="org.example.eye",
        version="2.0",
        release=7,
        fleet="red",
        step=step,
        sources={"b": Path("/drives/b"), "a": Path("/drives/a")},
        phases={"seen": AT, "ready": Moment(2.5, 3.5)},
        components=("eye", "lens--org-example-eye"),
        renamed={"lens": "lens--org-example-eye"},
        problems=(PROBLEM,),
    )


def component(
    id: str = "eye",
    payload: str = "k1",
    device: str | None = "usb1",
    nodes: tuple[Path, ...] = (Path("/dev/ttyUSB0"),),
) -> ComponentRecord:
    return ComponentRecord(
        id=id,
        payload=payload,
        payload_id="org.example.eye",
        distribution="eye",
        entry_point="eye:plugin",
        version="2.0",
        state=ComponentState.QUARANTINED,
        description=EYE,
        venv=Path("/venv"),
        site_packages=Path("/venv/site"),
        scratch=Path("/scratch"),
        rank=3,
        permissions=("devices",),
        settings={"gain": 1.5, "nested": {"list": [1, 2]}},
        devices=(
            DeviceClaim("port", {"ID_MODEL": "PT*"}, False, device, nodes, ("other",)),
            DeviceClaim("lamp", {"ID_MODEL": "L"}, True),
        ),
        problems=(PROBLEM,),
    )


def former(payload_id: str = "org.example.arm") -> FormerPayload:
    described = {"arm": replace(EYE, name="arm"), "hand": replace(EYE, name="hand", units=())}
    size = len(as_json(described))
    return FormerPayload(payload_id, "1.2", described, 1_700_000_000.5, size)


FULL = HostState(
    host="spot",
    revision=5,
    drives={
        "a": DriveRecord("a", "slot", Path("/drives/a"), since=AT, problems=(PROBLEM,)),
        "b": DriveRecord("b", "block", Path("/m"), Path("/dev/sdb1"), "vfat", DriveState.IDLE, AT),
    },
    payloads={"k1": payload(), "k2": payload("k2", Step.REFUSED)},
    components={"eye": component()},
    devices={
        "usb1": DeviceRecord(
            "usb1",
            (
                DeviceNode(Path("/dev/ttyUSB0"), {"ID_MODEL": "PTU"}, "00"),
                DeviceNode(Path("/dev/bus/usb/001/002"), {}),
            ),
            bus="usb",
            port="1-4.2",
            parent="usb:1-4",
            interfaces=(DeviceInterface("00", "ff:ff:ff", "ftdi_sio"),),
            driver="ftdi_sio",
            vendor="0403",
            product="6001",
            serial="A9",
            name="FTDI FT232R",
            first_s=1_700_000_000.5,
            since_s=1_700_000_001.5,
        )
    },
    known_devices={
        known.identity: known
        for known in (
            KnownDevice("usb 0403:6001 A9", "FTDI FT232R", "usb:1-4.2", 1_700_000_000.5, 2.0e9),
            KnownDevice("usb 16c0:05df at 1-1", "", "usb:1-1", 1.0, 2.0),
        )
    },
    mounts={
        "spot__eye__camera": MountPose(
            "spot__eye__camera", (0.1, 0.0, 1.0), (0.0, 0.2, 0.0), "person"
        )
    },
    connections={"eye.camera.odometry": "spot__base__odometry"},
    highwater={"org.example.eye": Highwater(7, "digest-k1")},
    rollbacks={"org.example.eye": Rollback("digest-k1", 7, 9)},
    goals={"3": GoalRecord("3", "look at the lamp", "(seen lamp)", "achieve", -2)},
    former={"org.example.arm": former()},
    names={
        "org.example.eye": GivenNames(
            {"eye": "eye", "lens": "lens--org-example-eye"}, {"eye": "eye--org-example-eye"}
        ),
    },
    tries={"k1": 2, "block:sdb1-7": 4},
    is_stopped=True,
)


@contextlib.asynccontextmanager
async def opened(path: Path) -> AsyncIterator[Catalogue]:
    catalogue = await Catalogue.open(path / "catalogue.sqlite", "spot")
    try:
        yield catalogue
    finally:
        await catalogue.close()


def entry(subject: str = "org.example.eye") -> JournalEntry:
    detail = {"n": 1, "folder": "/x"}
    return JournalEntry(0, AT, "boot", "PayloadFound", subject, "received", (PROBLEM,), detail)


@pytest.mark.anyio
async def test_what_is_written_counts_however_often_its_writer_is_cancelled(
    tmp_path: Path,
) -> None:
    async with opened(tmp_path) as catalogue:
        with contextlib.closing(sqlite3.connect(tmp_path / "catalogue.sqlite")) as other:
            other.execute("BEGIN IMMEDIATE")
            writing = asyncio.create_task(catalogue.commit(FULL, [entry()]))
            for _ in range(3):
                await asyncio.wait([writing], timeout=0.01)
                writing.cancel()
            other.rollback()
        with pytest.raises(asyncio.CancelledError):
            await writing
        assert catalogue.state == FULL
        assert catalogue.snapshot() == FULL.snapshot()
    async with opened(tmp_path) as again:
        assert again.state == FULL


@pytest.mark.anyio
async def test_committed_state_is_there_again(tmp_path: Path) -> None:
    async with opened(tmp_path) as catalogue:
        await catalogue.commit(FULL, ())
        assert catalogue.snapshot() == FULL.snapshot()
    async with opened(tmp_path) as catalogue:
        assert catalogue.state == FULL
        assert list(catalogue.state.payloads["k1"].sources) == ["b", "a"]


@pytest.mark.anyio
async def test_readers_see_nothing_of_the_last_daemon_before_recovery(tmp_path: Path) -> None:
    async with opened(tmp_path) as catalogue:
        await catalogue.commit(FULL, ())
    async with opened(tmp_path) as catalogue:
        assert not catalogue.snapshot().components
        assert catalogue.revision == FULL.revision


@pytest.mark.anyio
async def test_journal_is_told_by_subject_and_in_order(tmp_path: Path) -> None:
    async with opened(tmp_path) as catalogue:
        for n in range(5):
            await catalogue.commit(replace(FULL, revision=n), (entry(f"s{n % 2}"),))
        assert [e.subject for e in await catalogue.journal(limit=3)] == ["s0", "s1", "s0"]
        odd = await catalogue.journal(subject="s1")
        assert [e.id for e in odd] == [2, 4]
        assert odd[0] == replace(entry("s1"), id=2)
        assert [e.id for e in await catalogue.journal(after=4)] == [5]


@pytest.mark.anyio
async def test_entries_of_this_run_are_judged_by_the_monotonic_clock(tmp_path: Path) -> None:
    """The time was set while it ran: what came before is of 1970."""
    async with opened(tmp_path) as catalogue:
        before = [
            replace(entry(name), boot=boot, at=Moment(monotonic_s, wall_s))
            for name, boot, monotonic_s, wall_s in (
                ("old", catalogue.boot, 10.0, 100.0),
                ("recent", catalogue.boot, 90.0, 180.0),
                ("last run, old", "before", 95.0, 1e9),
                ("last run, recent", "before", 5.0, 2e9),
            )
        ]
        await catalogue.commit(FULL, before)
        found = await catalogue.journal(since=Since(catalogue.boot, Moment(50.0, 1.9e9)))
        assert [e.subject for e in found] == ["recent", "last run, recent"]


@pytest.mark.anyio
async def test_who_waits_for_the_journal_hears_of_each_commit(tmp_path: Path) -> None:
    async with opened(tmp_path) as catalogue:
        before = catalogue.commits
        waiting = asyncio.create_task(catalogue.changed(before))
        await catalogue.commit(FULL, (entry(),))
        assert await waiting > before


@pytest.mark.anyio
async def test_journal_cannot_be_changed(tmp_path: Path) -> None:
    async with opened(tmp_path) as catalogue:
        await catalogue.commit(FULL, (entry(),))
    connection = sqlite3.connect(tmp_path / "catalogue.sqlite")
    for statement in ("DELETE FROM journal", "UPDATE journal SET event = 'x'"):
        with pytest.raises(sqlite3.IntegrityError, match="append-only"):
            connection.execute(statement)
    connection.close()


def damaged(file: Path) -> None:
    file.write_bytes(b"\xff" * 8192)


def gone(file: Path) -> None:
    file.unlink()


def cut(file: Path) -> None:
    """As after a file system's repair."""
    with file.open("r+b") as out:
        out.truncate(file.stat().st_size // 2)


def unreadable(file: Path) -> None:
    """Sound as a file, and not in what it says."""
    with contextlib.closing(sqlite3.connect(file)) as connection, connection:
        connection.execute("UPDATE components SET description = '{'")


Harm = Callable[[Path], None]


@pytest.mark.anyio
@pytest.mark.parametrize("harm", [damaged, cut, unreadable])
async def test_damaged_file_is_set_aside(tmp_path: Path, harm: Harm) -> None:
    async with opened(tmp_path) as catalogue:
        await catalogue.commit(FULL, ())
    harm(tmp_path / "catalogue.sqlite")
    async with opened(tmp_path) as catalogue:
        assert catalogue.state == HostState("spot")
        assert catalogue.loss is not None
        assert catalogue.loss.instead is Instead.NOTHING
        assert catalogue.loss.aside is not None
        assert catalogue.loss.aside.exists()


@pytest.mark.anyio
@pytest.mark.parametrize("harm", [damaged, gone, cut, unreadable])
@pytest.mark.parametrize("is_last_whole", [True, False], ids=["last", "one-before"])
async def test_backup_takes_the_place_of_what_is_lost(
    tmp_path: Path, harm: Harm, is_last_whole: bool
) -> None:
    async with opened(tmp_path) as catalogue:
        await catalogue.commit(FULL, (entry(),))
        catalogue.backups.make()
        if not is_last_whole:
            catalogue.backups.make()
            damaged(catalogue.backups.newest)
        await catalogue.commit(replace(FULL, revision=6), (entry(),))
    harm(tmp_path / "catalogue.sqlite")
    async with opened(tmp_path) as catalogue:
        assert catalogue.state == FULL
        assert catalogue.loss is not None
        assert (catalogue.loss.instead, catalogue.loss.revision) == (Instead.BACKUP, 5)
        assert [told.id for told in await catalogue.journal()] == [1]
        await catalogue.commit(replace(FULL, revision=7), (entry(),))
    async with opened(tmp_path) as catalogue:
        assert (catalogue.loss, catalogue.revision) == (None, 7)


@pytest.mark.anyio
async def test_file_that_is_damaged_under_a_daemon_is_written_again(tmp_path: Path) -> None:
    async with opened(tmp_path) as catalogue:
        await catalogue.commit(FULL, (entry(),))
    async with opened(tmp_path) as catalogue:
        damaged(tmp_path / "catalogue.sqlite")
        later = replace(FULL, revision=6)
        await catalogue.commit(later, (entry(),))
        assert catalogue.loss is not None
        assert catalogue.loss.instead is Instead.MEMORY
    async with opened(tmp_path) as catalogue:
        assert catalogue.state == later


@contextlib.asynccontextmanager
async def disconnected(folder: Path) -> AsyncIterator[Catalogue]:
    """One that has to connect again, as after an error of SQLite's locks."""
    async with opened(folder) as catalogue:
        await catalogue.commit(FULL, (entry(),))
        await catalogue._run(catalogue._disconnect)
        yield catalogue


@pytest.mark.anyio
async def test_connection_is_made_again_as_soon_as_that_works(tmp_path: Path) -> None:
    async with disconnected(tmp_path) as catalogue:
        with descriptors_left(0), pytest.raises((sqlite3.Error, OSError)):
            await catalogue.commit(replace(FULL, revision=6), (entry(),))
        assert catalogue.state == FULL
        later = replace(FULL, revision=7)
        await catalogue.commit(later, (entry(),))
        assert catalogue.loss is None
    async with opened(tmp_path) as catalogue:
        assert catalogue.state == later
        assert len(await catalogue.journal()) == 2


@pytest.mark.anyio
async def test_journal_is_read_whether_connected_or_not(tmp_path: Path) -> None:
    async with disconnected(tmp_path) as catalogue:
        reading = catalogue.journal()
        await catalogue.commit(replace(FULL, revision=6), (entry(),))
        assert len(await reading) == 2
        await catalogue._run(catalogue._disconnect)
        assert len(await catalogue.journal()) == 2


@pytest.mark.anyio
@pytest.mark.parametrize("harm", [damaged, gone, cut, unreadable])
async def test_file_that_is_lost_before_it_is_connected_to_again_is_written_whole(
    tmp_path: Path, harm: Harm
) -> None:
    file = tmp_path / "catalogue.sqlite"
    async with disconnected(tmp_path) as catalogue:
        harm(file)
        with descriptors_left(0), pytest.raises((sqlite3.Error, OSError)):
            await catalogue.commit(replace(FULL, revision=6), (entry(),))
        later = replace(FULL, revision=7)
        await catalogue.commit(later, (entry(),))
        assert catalogue.loss is not None
        assert (catalogue.loss.instead, catalogue.loss.revision) == (Instead.MEMORY, 7)
        assert (catalogue.loss.aside is None) == (harm is gone)
    async with opened(tmp_path) as catalogue:
        assert catalogue.state == later


@pytest.mark.anyio
async def test_file_that_cannot_be_made_again_at_once_is_written_whole_later(
    tmp_path: Path,
) -> None:
    async with opened(tmp_path) as catalogue:
        await catalogue.commit(FULL, (entry(),))
        await catalogue._run(catalogue._set_aside)  # then the disk was full: no new one
        later = replace(FULL, revision=6)
        await catalogue.commit(later, (entry(),))
        assert catalogue.loss is not None
        assert catalogue.loss.aside is not None
    async with opened(tmp_path) as catalogue:
        assert catalogue.state == later


@pytest.mark.anyio
async def test_older_file_that_was_put_back_is_brought_up_to_date(tmp_path: Path) -> None:
    file = tmp_path / "catalogue.sqlite"
    async with opened(tmp_path / "other") as other:
        await other.commit(replace(FULL, goals={}, revision=2), ())
    async with disconnected(tmp_path) as catalogue:
        file.write_bytes((tmp_path / "other/catalogue.sqlite").read_bytes())
        later = replace(FULL, revision=7)
        await catalogue.commit(later, (entry(),))
    async with opened(tmp_path) as catalogue:
        assert catalogue.state == later


@pytest.mark.parametrize(
    ("code", "is_locked"),
    [(sqlite3.SQLITE_PROTOCOL, True), (sqlite3.SQLITE_BUSY, False), (sqlite3.SQLITE_FULL, False)],
)
def test_lock_that_is_never_let_go_of_takes_another_connection(code: int, is_locked: bool) -> None:
    error = sqlite3.OperationalError("locking protocol")
    error.sqlite_errorcode = code
    assert database.is_locked_for_good(error) == is_locked


@pytest.mark.anyio
async def test_backup_does_not_wait_for_writers_nor_they_for_it(tmp_path: Path) -> None:
    async with opened(tmp_path) as catalogue:
        await catalogue.commit(FULL, ())
        writer = sqlite3.connect(tmp_path / "catalogue.sqlite", isolation_level=None)
        writer.execute("BEGIN IMMEDIATE")
        writer.execute("UPDATE host SET revision = 99")
        catalogue.backups.make()
        writer.execute("COMMIT")
        writer.close()
        (backup,) = catalogue.backups.found()
    with contextlib.closing(sqlite3.connect(backup)) as connection:
        assert connection.execute("SELECT revision FROM host").fetchall() == [(FULL.revision,)]


@pytest.mark.anyio
async def test_journal_keeps_the_last_entries(tmp_path: Path) -> None:
    catalogue = await Catalogue.open(tmp_path / "catalogue.sqlite", "spot", keep=journal.KEEP_LEAST)
    for n in range(8):
        await catalogue.commit(replace(FULL, revision=n), [entry(f"s{n}")] * 250)
    kept = await catalogue.journal(limit=10_000)
    await catalogue.close()
    assert [kept[-1].id, kept[-1].subject] == [2000, "s7"]
    assert journal.KEEP_LEAST <= len(kept) <= journal.KEEP_LEAST + journal.BATCH


@pytest.mark.anyio
async def test_what_cannot_be_written_is_owed(tmp_path: Path) -> None:
    """Somebody else holds the file: as a disk that fails for a while."""
    async with opened(tmp_path) as catalogue:
        await catalogue.commit(FULL, (entry("one"),))
        await catalogue._run(lambda: catalogue._connected().execute("PRAGMA busy_timeout = 0"))
        other = sqlite3.connect(tmp_path / "catalogue.sqlite", isolation_level=None)
        other.execute("BEGIN IMMEDIATE")
        two, three = replace(FULL, revision=6), replace(FULL, revision=7, goals={})
        with pytest.raises(sqlite3.OperationalError) as failed:
            await catalogue.commit(two, (entry("two"),))
        assert catalogue.state == FULL
        catalogue.owe(two, (entry("two"),), failed.value)
        assert catalogue.state == two
        assert catalogue.unwritten is not None
        other.execute("COMMIT")
        other.close()
        await catalogue.commit(three, (entry("three"),))
        assert catalogue.unwritten is None
        assert [told.subject for told in await catalogue.journal()] == ["one", "two", "three"]
    async with opened(tmp_path) as catalogue:
        assert catalogue.state == three


@pytest.mark.anyio
async def test_file_of_another_version_is_left_alone(tmp_path: Path) -> None:
    async with opened(tmp_path):
        pass
    connection = sqlite3.connect(tmp_path / "catalogue.sqlite")
    connection.execute("PRAGMA user_version = 99")
    connection.close()
    with pytest.raises(ConfigRefused) as refused:
        async with opened(tmp_path):
            pass
    assert refused.value.code == "CATALOGUE_VERSION"


OF_7 = replace(
    FULL,
    payloads={
        key: replace(one, components=("eye",), renamed={}) for key, one in FULL.payloads.items()
    },
    names={},
)
OF_6 = replace(OF_7, connections={})
OF_5 = replace(
    OF_6, devices={}, known_devices={}, components={"eye": component(device=None, nodes=())}
)
THE_8 = (
    "DROP TABLE names; ALTER TABLE payloads DROP COLUMN renamed;"
    "ALTER TABLE payloads ADD COLUMN waits_for TEXT NOT NULL DEFAULT '';"
)
THE_7 = f"{THE_8} DROP TABLE connections;"
THE_6 = (
    f"{THE_7} ALTER TABLE highwater RENAME TO highest; CREATE TABLE highwater (fleet TEXT NOT NULL,"
    " payload_id TEXT NOT NULL, release INTEGER NOT NULL, digest TEXT NOT NULL,"
    " owner TEXT NOT NULL, PRIMARY KEY (fleet, payload_id)) STRICT;"
    "INSERT INTO highwater SELECT 'red', payload_id, release, digest, owner FROM highest;"
    "ALTER TABLE rollbacks RENAME TO latest; CREATE TABLE rollbacks (fleet TEXT NOT NULL,"
    " payload_id TEXT NOT NULL, digest TEXT NOT NULL, release INTEGER NOT NULL,"
    " below INTEGER NOT NULL, PRIMARY KEY (fleet, payload_id)) STRICT;"
    "INSERT INTO rollbacks SELECT 'red', payload_id, digest, release, below FROM latest;"
    "DROP TABLE highest; DROP TABLE latest;"
)
THE_5 = (
    f"{THE_6} DROP TABLE device_nodes; DROP TABLE device_interfaces; DROP TABLE known_devices;"
    "ALTER TABLE claims DROP COLUMN nodes; DROP TABLE devices;"
    "CREATE TABLE devices (id TEXT PRIMARY KEY, node TEXT NOT NULL, properties TEXT NOT NULL)"
    " STRICT; INSERT INTO devices VALUES ('usb1', '/dev/ttyUSB0', '{}');"
    "UPDATE claims SET device = 'usb1' WHERE name = 'port';"
)
OF_4 = replace(OF_5, tries={}, is_stopped=False, rollbacks={})
THE_4 = (
    f"{THE_5}"
    "ALTER TABLE drives DROP COLUMN mark;"
    "DROP TABLE tries; DROP TABLE rollbacks; ALTER TABLE host DROP COLUMN stopped;"
    "ALTER TABLE payloads ADD COLUMN attempts INTEGER NOT NULL DEFAULT 0;"
    "ALTER TABLE payloads DROP COLUMN was; ALTER TABLE highwater DROP COLUMN owner;"
)
OF_3 = replace(OF_4, former={})
OLDER = {
    1: (f"{THE_4} DROP TABLE goals; DROP TABLE former;", replace(OF_3, goals={})),
    2: (f"{THE_4} DROP TABLE former;", OF_3),
    3: (THE_4, OF_4),
    4: (THE_5, OF_5),
    5: (THE_6, OF_6),
    6: (THE_7, OF_6),
    7: (THE_8, OF_7),
}
"""Schema → what makes it of the present one, and what it can hold of `FULL`."""


@pytest.mark.anyio
@pytest.mark.parametrize("schema", OLDER)
async def test_file_of_a_version_before_is_taken_over(tmp_path: Path, schema: int) -> None:
    script, before = OLDER[schema]
    async with opened(tmp_path) as catalogue:
        await catalogue.commit(before, ())
    connection = sqlite3.connect(tmp_path / "catalogue.sqlite")
    connection.executescript(f"{script} PRAGMA user_version = {schema};")
    connection.close()
    async with opened(tmp_path) as catalogue:
        assert catalogue.state == before
        await catalogue.commit(FULL, ())
    async with opened(tmp_path) as catalogue:
        assert catalogue.state == FULL


@pytest.mark.anyio
async def test_highest_release_of_any_fleet_is_taken_over(tmp_path: Path) -> None:
    """Schema 5 kept the newest release of each fleet."""
    async with opened(tmp_path):
        pass
    connection = sqlite3.connect(tmp_path / "catalogue.sqlite")
    connection.executescript(f"{THE_6} PRAGMA user_version = 5;")
    known = (
        ("", "org.example.eye", 3, "old", ""),
        ("survey", "org.example.eye", 9, "new", "maker"),
        ("rescue", "org.example.eye", 9, "twin", "other"),
        ("", "org.example.arm", 5, "arm", ""),
        ("survey", "org.example.arm", 2, "arm-2", ""),
    )
    with connection:
        connection.executemany("INSERT INTO highwater VALUES (?, ?, ?, ?, ?)", known)
        back = (("", "org.example.eye", "a", 1, 3), ("survey", "org.example.eye", "b", 8, 9))
        connection.executemany("INSERT INTO rollbacks VALUES (?, ?, ?, ?, ?)", back)
    connection.close()
    async with opened(tmp_path) as catalogue:
        assert catalogue.state.highwater == {
            "org.example.eye": Highwater(9, "new", "maker"),
            "org.example.arm": Highwater(5, "arm", ""),
        }
        assert catalogue.state.rollbacks == {"org.example.eye": Rollback("b", 8, 9)}


@pytest.mark.anyio
async def test_memory_that_cannot_be_read_stops_nothing(tmp_path: Path) -> None:
    async with opened(tmp_path) as catalogue:
        await catalogue.commit(FULL, ())
    connection = sqlite3.connect(tmp_path / "catalogue.sqlite")
    for components in ("{", "[1]", '{"arm": {"nme": "arm"}}'):
        with connection:
            connection.execute("UPDATE former SET components = ?", (components,))
        async with opened(tmp_path) as catalogue:
            assert catalogue.state == replace(FULL, former={})
    connection.close()


@pytest.mark.anyio
async def test_commit_is_whole_or_not_at_all(tmp_path: Path) -> None:
    async with opened(tmp_path) as catalogue:
        orphan = replace(FULL, components={"eye": component(payload="none")})
        with pytest.raises(sqlite3.IntegrityError):
            await catalogue.commit(orphan, (entry(),))
        assert catalogue.state == HostState("spot")
        assert await catalogue.journal() == ()


@pytest.mark.anyio
async def test_half_a_letter_is_no_reason_to_fail(tmp_path: Path) -> None:
    """JSON and names of files can have what no UTF-8, and so no row, has."""
    half = replace(PROBLEM, message="half a letter: \ud83e", where="name-\udcff")
    drive = replace(FULL.drives["a"], id="a", problems=(half,), root=Path("/drives/\udcff"))
    state = replace(FULL, drives={"a": drive})
    async with opened(tmp_path) as kept:
        await kept.commit(state, (replace(entry("\udcff"), problems=(half,)),))
    async with opened(tmp_path) as again:
        assert again.state.drives["a"].problems == (half,)


@pytest.mark.anyio
async def test_everything_can_be_asked_in_sql(tmp_path: Path) -> None:
    async with opened(tmp_path) as catalogue:
        await catalogue.commit(FULL, ())
    connection = sqlite3.connect(tmp_path / "catalogue.sqlite")
    asked = {
        "behaviours": ("eye", "stream", "(stream ?u - camera)", 1, '["look"]'),
        "fragments": ("eye", "domain.pddl", "(define (domain eye))"),
        "units": ("spot__eye__camera", "eye", "camera", "camera"),
        "streams": ("spot__eye__video", "eye", "camera", "image"),
        "phrases": ("eye", "look at {t:target}", "(seen ?t)"),
        "labels": ("eye", "lamp", "the lamp"),
    }
    for view, row in asked.items():
        assert connection.execute(f"SELECT * FROM {view}").fetchall() == [row]
    assert connection.execute("SELECT * FROM conditions").fetchall() == []
    connection.close()


STATES = st.lists(
    st.builds(
        HostState,
        host=st.just("spot"),
        revision=st.integers(0, 9),
        drives=st.sampled_from([{}, FULL.drives]),
        payloads=st.sampled_from([{"k1": payload()}, {"k1": payload("k1", Step.REMOVING)}]),
        components=st.sampled_from(
            [{}, {"eye": component(device=None)}, {"arm": component("arm", device=None)}]
        ),
        devices=st.sampled_from([{}, FULL.devices]),
        mounts=st.sampled_from([{}, FULL.mounts]),
        former=st.sampled_from([{}, FULL.former, {"org.example.leg": former("org.example.leg")}]),
    ),
    min_size=2,
    max_size=4,
)


@given(STATES)
@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_differences_add_up_to_the_last_state(
    tmp_path_factory: pytest.TempPathFactory, states: list[HostState]
) -> None:
    connection = database.connect(tmp_path_factory.mktemp("catalogue") / "catalogue.sqlite")
    before = HostState("spot")
    for state in states:
        database.write(connection, before, state, ())
        before = state
    assert database.load(connection, "spot") == states[-1]
    connection.close()

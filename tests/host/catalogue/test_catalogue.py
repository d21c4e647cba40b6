"""The catalogue keeps what was committed, and tells how it came to it."""

from __future__ import annotations

import contextlib
import sqlite3
from collections.abc import AsyncIterator
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from nondum.host.catalogue import database
from nondum.host.catalogue.catalogue import Catalogue
from nondum.host.catalogue.records import (
    ComponentRecord,
    ComponentState,
    DeviceClaim,
    DeviceRecord,
    DriveRecord,
    DriveState,
    FormerPayload,
    GoalRecord,
    JournalEntry,
    Moment,
    MountPose,
    PayloadRecord,
    Step,
)
from nondum.host.catalogue.rows import as_json
from nondum.host.catalogue.state import Highwater, HostState
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
        attempts=2,
        waits_for="k9",
        components=("eye",),
        problems=(PROBLEM,),
    )


def component(id: str = "eye", payload: str = "k1", device: str | None = "usb1") -> ComponentRecord:
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
            DeviceClaim("port", {"ID_MODEL": "PT*"}, False, device, ("other",)),
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
    devices={"usb1": DeviceRecord("usb1", Path("/dev/ttyUSB0"), {"ID_MODEL": "PTU"})},
    mounts={
        "spot__eye__camera": MountPose(
            "spot__eye__camera", (0.1, 0.0, 1.0), (0.0, 0.2, 0.0), "person"
        )
    },
    highwater={("red", "org.example.eye"): Highwater(7, "digest-k1")},
    goals={"3": GoalRecord("3", "look at the lamp", "(seen lamp)", "achieve", -2)},
    former={"org.example.arm": former()},
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
async def test_journal_cannot_be_changed(tmp_path: Path) -> None:
    async with opened(tmp_path) as catalogue:
        await catalogue.commit(FULL, (entry(),))
    connection = sqlite3.connect(tmp_path / "catalogue.sqlite")
    for statement in ("DELETE FROM journal", "UPDATE journal SET event = 'x'"):
        with pytest.raises(sqlite3.IntegrityError, match="append-only"):
            connection.execute(statement)
    connection.close()


@pytest.mark.anyio
async def test_damaged_file_is_set_aside(tmp_path: Path) -> None:
    async with opened(tmp_path) as catalogue:
        await catalogue.commit(FULL, ())
    file = tmp_path / "catalogue.sqlite"
    file.write_bytes(b"\xff" * 8192)
    async with opened(tmp_path) as catalogue:
        assert catalogue.state == HostState("spot")
        assert catalogue.set_aside is not None
        assert catalogue.set_aside.exists()


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


OLDER = {
    1: ("DROP TABLE goals; DROP TABLE former;", replace(FULL, goals={}, former={})),
    2: ("DROP TABLE former;", replace(FULL, former={})),
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
        orphan = replace(FULL, components={"eye": component(payload="nobody")})
        with pytest.raises(sqlite3.IntegrityError):
            await catalogue.commit(orphan, (entry(),))
        assert catalogue.state == HostState("spot")
        assert await catalogue.journal() == ()


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

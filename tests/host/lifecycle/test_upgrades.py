"""Newer releases on a real store, with real workers: they take over when healthy, or not at all."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from tests.host.lifecycle.living import LAMP, Living, left_over, living
from tests.payloads import Part, make_payload

from nondum.host import events
from nondum.host.catalogue.records import PayloadRecord, Step
from nondum.host.workers import Timing
from nondum.sdk.description import PluginDescription

pytestmark = pytest.mark.anyio

LAMP_ID = "org.example.lamp"
WATCHED = Timing(startup_s=2.0, settle_beats=1)
"""Long enough to see a worker fall, short enough to wait for."""
QUICK = Timing(startup_s=5.0, settle_beats=0)
"""Where it does not matter how long a release is watched."""

FALLS = (
    LAMP
    + """
@hookimpl
def start(ctx):
    import os, threading
    threading.Timer(0.5, os._exit, (3,)).start()
"""
)
"""Is what it says, starts, and ends soon after."""

STUCK = (
    LAMP
    + """
@hookimpl
def start(ctx):
    import time
    time.sleep(3600)
"""
)
"""Never comes to an end of its start."""

UNIT = "spot__lamp__lamp"


def lamp(root: Path, release: int, source: str = LAMP, **about: str) -> Path:
    """A drive with a release of the lamp."""
    drive = root / f"drive-{release}"
    part = Part("lamp", source, version=f"{release}.0")
    version = f"{release}.0"
    make_payload(drive, part, payload_id=LAMP_ID, version=version, release=release, **about)
    return drive


def release(host: Living, number: int) -> PayloadRecord | None:
    every = (p for p in host.snapshot.payloads if p.payload_id == LAMP_ID)
    return next((p for p in every if p.release == number), None)


async def until(host: Living, **wanted: Step | None) -> None:
    """Wait until releases (`r1=…`) are at steps; None: gone."""

    def holds() -> bool:
        found = {name: release(host, int(name[1:])) for name in wanted}
        return all((one.step if one else None) is wanted[name] for name, one in found.items())

    await host.until(holds)


def version(host: Living) -> str:
    """The version of the lamp that is in force."""
    component = host.snapshot.component("lamp")
    return component.version if component is not None else ""


def is_running(pid: int) -> bool:
    return Path(f"/proc/{pid}").exists()


async def test_newer_release_takes_over_and_the_old_one_comes_back(tmp_path: Path) -> None:
    drives = {number: lamp(tmp_path, number) for number in (1, 2)}
    async with living(tmp_path, timing=QUICK) as host:
        host.plug(drives[1], "a")
        await until(host, r1=Step.ACTIVE)
        old = host.workers.pids()["lamp"]
        shining = host.workers.behave("lamp", "shine", {"u": UNIT})
        revision = host.snapshot.revision
        host.plug(drives[2], "b")
        await until(host, r1=Step.SUPERSEDED, r2=Step.ACTIVE)
        assert host.snapshot.revision == revision + 1
        assert version(host) == "2.0"
        assert host.workers.pids()["lamp"] != old
        again = host.workers.behave("lamp", "shine", {"u": UNIT})
        established = events.BehaviourEstablished
        await host.until(lambda: established("lamp", "shine", again.id) in host.heard)
        assert shining.state.has_ended
        assert not is_running(old), "two releases never act at the same time"
        kinds = [type(event) for event in host.heard]
        assert events.WorkerExited not in kinds
        host.pull("b")
        await until(host, r1=Step.ACTIVE, r2=None)
        assert version(host) == "1.0"
        host.pull("a")
        await until(host, r1=None)
        assert not left_over(host.folders)
        assert not host.workers.pids()


BROKEN = {
    "cannot be imported": ("import no_such_module", PluginDescription("test-lamp", "2.0")),
    "is not what it says": (LAMP, PluginDescription("test-lamp", "2.0", summary="another")),
    "falls while it is watched": (FALLS, None),
    "hangs at its start": (STUCK, None),
}


@pytest.mark.parametrize("how", BROKEN)
async def test_broken_release_leaves_the_old_one_alone(tmp_path: Path, how: str) -> None:
    source, described = BROKEN[how]
    first = lamp(tmp_path, 1)
    part = Part("lamp", source, described, version="2.0")
    make_payload(tmp_path / "drive-2", part, payload_id=LAMP_ID, version="2.0", release=2)
    async with living(tmp_path, timing=WATCHED) as host:
        host.plug(first, "a")
        await until(host, r1=Step.ACTIVE)
        old, revision = host.workers.pids(), host.snapshot.revision
        host.plug(tmp_path / "drive-2", "b")
        await until(host, r1=Step.ACTIVE, r2=Step.QUARANTINED)
        assert host.workers.pids() == old
        assert host.snapshot.revision == revision
        failed = release(host, 2)
        assert failed is not None
        assert failed.problems
        host.pull("b")
        await until(host, r1=Step.ACTIVE, r2=None)
        assert host.workers.pids() == old


@pytest.mark.parametrize("source", [LAMP, "import no_such_module"], ids=["sound", "broken"])
async def test_release_that_runs_alone_takes_the_place_first(tmp_path: Path, source: str) -> None:
    """And gives it back, should it not work."""
    first = lamp(tmp_path, 1)
    described = None if source == LAMP else PluginDescription("test-lamp", "2.0")
    part = Part("lamp", source, described, version="2.0")
    about = {"version": "2.0", "requires": "alone = true"}
    make_payload(tmp_path / "drive-2", part, payload_id=LAMP_ID, release=2, **about)
    async with living(tmp_path, timing=QUICK) as host:
        host.plug(first, "a")
        await until(host, r1=Step.ACTIVE)
        old = host.workers.pids()["lamp"]
        host.plug(tmp_path / "drive-2", "b")
        if source == LAMP:
            await until(host, r1=Step.SUPERSEDED, r2=Step.ACTIVE)
        else:
            await until(host, r1=Step.ACTIVE, r2=Step.QUARANTINED)
        assert not is_running(old)
        (refused,) = (e for e in host.heard if isinstance(e, events.BesideRefused))
        assert refused.reason == "its manifest says that it runs alone"


async def test_new_drive_pulled_during_the_bring_up(tmp_path: Path) -> None:
    drives = lamp(tmp_path, 1), lamp(tmp_path, 2)
    async with living(tmp_path, timing=WATCHED) as host:
        host.plug(drives[0], "a")
        await until(host, r1=Step.ACTIVE)
        old = host.workers.pids()
        host.plug(drives[1], "b")
        await until(host, r2=Step.PROBED)
        host.pull("b")
        await until(host, r1=Step.ACTIVE, r2=None)
        assert host.workers.pids() == old
        processes = [int(p.name) for p in Path("/proc").iterdir() if p.name.isdigit()]
        mine = [pid for pid in processes if _is_of(pid, host.folders.scratches)]
        assert set(mine) == set(old.values())


def _is_of(pid: int, folder: Path) -> bool:
    try:
        return os.fsencode(folder) in Path(f"/proc/{pid}/environ").read_bytes()
    except OSError:
        return False


async def test_old_drive_pulled_during_the_bring_up(tmp_path: Path) -> None:
    drives = lamp(tmp_path, 1), lamp(tmp_path, 2)
    async with living(tmp_path, timing=WATCHED) as host:
        host.plug(drives[0], "a")
        await until(host, r1=Step.ACTIVE)
        host.plug(drives[1], "b")
        await until(host, r2=Step.PROBED)
        host.pull("a")
        await until(host, r1=None, r2=Step.ACTIVE)
        assert version(host) == "2.0"
        newer = release(host, 2)
        assert newer is not None
        assert {path.name for path in left_over(host.folders)} == {newer.key}


async def test_a_person_goes_back_and_forward(tmp_path: Path) -> None:
    drives = lamp(tmp_path, 1), lamp(tmp_path, 2)
    async with living(tmp_path, timing=QUICK) as host:
        host.plug(drives[0], "a")
        host.plug(drives[1], "b")
        await until(host, r1=Step.SUPERSEDED, r2=Step.ACTIVE)
        first = release(host, 1)
        assert first is not None
        host.bus.emit(events.RollbackAsked(first.key, 1, 2))
        await until(host, r1=Step.ACTIVE, r2=Step.SUPERSEDED)
        assert version(host) == "1.0"
    async with living(tmp_path, timing=QUICK) as host:
        await until(host, r1=Step.ACTIVE, r2=Step.SUPERSEDED)
        assert version(host) == "1.0"
        second = release(host, 2)
        assert second is not None
        host.bus.emit(events.RetryAsked(second.key))
        await until(host, r1=Step.SUPERSEDED, r2=Step.ACTIVE)

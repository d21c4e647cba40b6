"""Newer releases on a real store, with real workers: they take over when healthy, or not at all."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

import pytest
from tests.kit.clock import VirtualClock
from tests.kit.golden import Golden
from tests.kit.host import LAMP, HostInProcess, host_in_process, left_over
from tests.kit.payloads import Part, make_payload

from nondum.host.core.events.behaviours import BehaviourEstablished
from nondum.host.core.events.payloads import RetryAsked
from nondum.host.core.events.releases import BesideRefused, RollbackAsked
from nondum.host.core.events.workers import WorkerExited
from nondum.host.core.records.step import Step
from nondum.host.manager.initial_components import install, uninstall
from nondum.host.manager.rollback import go_back
from nondum.host.workers.spec import Timing
from nondum.sdk.description import PluginDescription
from nondum.sdk.errors import InstallFailed, PayloadRefused, Problem

pytestmark = pytest.mark.anyio

LAMP_ID = "org.example.lamp"
BROUGHT_UP = Timing(settle_beats=1)
WATCHED = Timing(settle_beats=1, missed=1_000_000)
"""Long enough to see a worker fall, short enough to wait for. No worker hangs but at its start."""
QUICK = Timing(startup_s=20.0, settle_beats=0)
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


def lamp(root: Path, release: int) -> Path:
    """A drive with a release of the lamp."""
    drive = root / f"drive-{release}"
    version = f"{release}.0"
    part = Part("lamp", LAMP, version=version)
    make_payload(drive, part, payload_id=LAMP_ID, version=version, release=release)
    return drive


def version(host: HostInProcess) -> str:
    """The version of the lamp that is active."""
    component = host.snapshot.component("lamp")
    return component.version if component is not None else ""


def is_running(pid: int) -> bool:
    return Path(f"/proc/{pid}").exists()


async def test_newer_release_takes_over_and_the_old_one_comes_back(tmp_path: Path) -> None:
    drives = {number: lamp(tmp_path, number) for number in (1, 2)}
    async with host_in_process(tmp_path, timing=QUICK) as host:
        host.plug(drives[1], "a")
        await host.until_releases(LAMP_ID, r1=Step.ACTIVE)
        old = host.workers.pids()["lamp"]
        shining = host.workers.behave("lamp", "shine", {"u": UNIT})
        revision = host.snapshot.revision
        host.plug(drives[2], "b")
        await host.until_releases(LAMP_ID, r1=Step.SUPERSEDED, r2=Step.ACTIVE)
        assert host.snapshot.revision == revision + 1
        assert version(host) == "2.0"
        assert host.workers.pids()["lamp"] != old
        again = host.workers.behave("lamp", "shine", {"u": UNIT})
        established = BehaviourEstablished
        await host.until(lambda: established("lamp", "shine", again.id) in host.heard)
        assert shining.state.has_ended
        assert not is_running(old), "two releases never act at the same time"
        kinds = [type(event) for event in host.heard]
        assert WorkerExited not in kinds
        host.pull("b")
        await host.until_releases(LAMP_ID, r1=Step.ACTIVE, r2=None)
        assert version(host) == "1.0"
        host.pull("a")
        await host.until_releases(LAMP_ID, r1=None)
        assert not left_over(host.folders)
        assert not host.workers.pids()


DYING = (
    LAMP
    + """
from nondum.sdk import condition

@condition("sight", predicates=("seen",))
async def sight(ctx):
    await ctx.sleep(3600)

@hookimpl
async def start(ctx):
    told = {"message": "blind", "where": "test_lamp.py:3"}
    ctx._workplace.tell("condition-ended", {"condition": "sight", "problem": told}, None)
"""
)
"""Says that its condition has ended before it says that it has started."""


async def test_condition_that_ends_before_its_component_is_there_is_its_problem(
    tmp_path: Path,
) -> None:
    """Of a first release, and of one brought up beside another, which has no listener yet."""
    drives = [tmp_path / "drive-1", tmp_path / "drive-2"]
    for number, drive in enumerate(drives, 1):
        part = Part("lamp", DYING, version=f"{number}.0")
        make_payload(drive, part, payload_id=LAMP_ID, version=part.version, release=number)
    async with host_in_process(tmp_path, timing=BROUGHT_UP) as host:
        for number, drive in enumerate(drives, 1):
            host.plug(drive, str(number))
            await host.until(lambda: version(host) == f"{number}.0")  # noqa: B023  # awaited at once
            await host.until(lambda: bool(problems_of_lamp(host)))
            (problem,) = problems_of_lamp(host)
            assert problem.code == "CONDITION_RAISED"
            assert problem.where == "sight of lamp (test_lamp.py:3)"


def problems_of_lamp(host: HostInProcess) -> tuple[Problem, ...]:
    component = host.snapshot.component("lamp")
    return component.problems if component is not None else ()


async def test_components_come_and_go_with_a_release(tmp_path: Path) -> None:
    """None of the new ones counts before all of them do."""
    for number, other in ((1, "bell"), (2, "horn")):
        parts = [Part(id, LAMP, version=f"{number}.0") for id in ("lamp", other)]
        version = f"{number}.0"
        drive = tmp_path / f"drive-{number}"
        make_payload(drive, *parts, payload_id=LAMP_ID, version=version, release=number)
    async with host_in_process(tmp_path, timing=BROUGHT_UP) as host:
        host.plug(tmp_path / "drive-1", "a")
        await host.until_releases(LAMP_ID, r1=Step.ACTIVE)
        host.plug(tmp_path / "drive-2", "b")
        await host.until_releases(LAMP_ID, r2=Step.PROBED)
        assert set(host.workers.pids()) == {"bell", "lamp"}
        await host.until_releases(LAMP_ID, r1=Step.SUPERSEDED, r2=Step.ACTIVE)
        assert {c.id for c in host.snapshot.components} == {"horn", "lamp"}
        await host.until(lambda: set(host.workers.pids()) == {"horn", "lamp"})
        host.pull("b")
        await host.until_releases(LAMP_ID, r1=Step.ACTIVE, r2=None)
        assert set(host.workers.pids()) == {"bell", "lamp"}


BROKEN = {
    "cannot be imported": ("import no_such_module", PluginDescription("test-lamp", "2.0")),
    "is not what it says": (LAMP, PluginDescription("test-lamp", "2.0", summary="another")),
    "falls while it is watched": (FALLS, None),
    "hangs at its start": (STUCK, None),
}


@pytest.mark.parametrize("how", BROKEN)
async def test_broken_release_leaves_the_old_one_alone(
    tmp_path: Path, clock: VirtualClock, how: str
) -> None:
    source, described = BROKEN[how]
    first = lamp(tmp_path, 1)
    part = Part("lamp", source, described, version="2.0")
    make_payload(tmp_path / "drive-2", part, payload_id=LAMP_ID, version="2.0", release=2)
    async with host_in_process(tmp_path, timing=WATCHED) as host:
        host.plug(first, "a")
        await host.until_releases(LAMP_ID, r1=Step.ACTIVE)
        old, revision = host.workers.pids(), host.snapshot.revision
        host.plug(tmp_path / "drive-2", "b")
        judged = host.until_releases(LAMP_ID, r1=Step.ACTIVE, r2=Step.QUARANTINED)
        if source is STUCK:
            await host.until_releases(LAMP_ID, r2=Step.STORED)
            await clock.advance_until(judged, step_s=WATCHED.startup_s)
        else:
            await judged
        assert host.workers.pids() == old
        assert host.snapshot.revision == revision
        failed = host.release(LAMP_ID, 2)
        assert failed is not None
        assert failed.problems
        host.pull("b")
        await host.until_releases(LAMP_ID, r1=Step.ACTIVE, r2=None)
        assert host.workers.pids() == old


@pytest.mark.parametrize("source", [LAMP, "import no_such_module"], ids=["sound", "broken"])
async def test_release_that_runs_alone_takes_the_place_first(
    tmp_path: Path, source: str, golden: Golden
) -> None:
    """And gives it back, should it not work."""
    first = lamp(tmp_path, 1)
    described = None if source == LAMP else PluginDescription("test-lamp", "2.0")
    part = Part("lamp", source, described, version="2.0")
    folder = tmp_path / "drive-2"
    alone = "alone = true"
    make_payload(folder, part, payload_id=LAMP_ID, version="2.0", release=2, requires=alone)
    async with host_in_process(tmp_path, timing=QUICK) as host:
        host.plug(first, "a")
        await host.until_releases(LAMP_ID, r1=Step.ACTIVE)
        old = host.workers.pids()["lamp"]
        host.plug(tmp_path / "drive-2", "b")
        if source == LAMP:
            await host.until_releases(LAMP_ID, r1=Step.SUPERSEDED, r2=Step.ACTIVE)
        else:
            await host.until_releases(LAMP_ID, r1=Step.ACTIVE, r2=Step.QUARANTINED)
        assert not is_running(old)
        (refused,) = (e for e in host.heard if isinstance(e, BesideRefused))
        golden.check("the manifest says that it runs alone", refused.reason)


async def test_new_drive_pulled_during_the_bring_up(tmp_path: Path) -> None:
    drives = lamp(tmp_path, 1), lamp(tmp_path, 2)
    async with host_in_process(tmp_path, timing=BROUGHT_UP) as host:
        host.plug(drives[0], "a")
        await host.until_releases(LAMP_ID, r1=Step.ACTIVE)
        old = host.workers.pids()
        host.plug(drives[1], "b")
        await host.until_releases(LAMP_ID, r2=Step.PROBED)
        host.pull("b")
        await host.until_releases(LAMP_ID, r1=Step.ACTIVE, r2=None)
        assert host.workers.pids() == old
        assert _processes_of(host.folders.scratches) == set(old.values())


def _processes_of(folder: Path) -> set[int]:
    """Processes whose environment names a folder."""
    found = set()
    for process in Path("/proc").iterdir():
        with contextlib.suppress(OSError):
            if process.name.isdigit() and os.fsencode(folder) in (process / "environ").read_bytes():
                found.add(int(process.name))
    return found


async def test_old_drive_pulled_during_the_bring_up(tmp_path: Path) -> None:
    drives = lamp(tmp_path, 1), lamp(tmp_path, 2)
    async with host_in_process(tmp_path, timing=BROUGHT_UP) as host:
        host.plug(drives[0], "a")
        await host.until_releases(LAMP_ID, r1=Step.ACTIVE)
        host.plug(drives[1], "b")
        await host.until_releases(LAMP_ID, r2=Step.PROBED)
        host.pull("a")
        await host.until_releases(LAMP_ID, r1=None, r2=Step.ACTIVE)
        assert version(host) == "2.0"
        newer = host.release(LAMP_ID, 2)
        assert newer is not None
        assert {path.name for path in left_over(host.folders)} == {newer.key}


async def test_a_person_goes_back_and_forward(tmp_path: Path) -> None:
    drives = lamp(tmp_path, 1), lamp(tmp_path, 2)
    async with host_in_process(tmp_path, timing=QUICK) as host:
        host.plug(drives[0], "a")
        host.plug(drives[1], "b")
        await host.until_releases(LAMP_ID, r1=Step.SUPERSEDED, r2=Step.ACTIVE)
        first = host.release(LAMP_ID, 1)
        assert first is not None
        host.bus.emit(RollbackAsked(first.key, 1, 2))
        await host.until_releases(LAMP_ID, r1=Step.ACTIVE, r2=Step.SUPERSEDED)
        assert version(host) == "1.0"
    async with host_in_process(tmp_path, timing=QUICK) as host:
        await host.until_releases(LAMP_ID, r1=Step.ACTIVE, r2=Step.SUPERSEDED)
        assert version(host) == "1.0"
        second = host.release(LAMP_ID, 2)
        assert second is not None
        host.bus.emit(RetryAsked(second.key))
        await host.until_releases(LAMP_ID, r1=Step.SUPERSEDED, r2=Step.ACTIVE)


async def test_installed_payload_is_upgraded_and_the_one_before_is_kept(tmp_path: Path) -> None:
    folders = {n: lamp(tmp_path, n) / "nondum" / LAMP_ID for n in (1, 2, 3)}
    async with host_in_process(tmp_path, timing=QUICK) as host:
        for number, folder in folders.items():
            installed = await install(folder, host.catalogue, host.bus)
            assert (installed.release, installed.step) == (number, Step.ACTIVE)
        await host.until_releases(LAMP_ID, r1=None, r2=Step.SUPERSEDED, r3=Step.ACTIVE)
        with pytest.raises(PayloadRefused) as refused:
            await install(folders[3], host.catalogue, host.bus)
        assert refused.value.code == "ALREADY_PRESENT"
        back = await go_back(LAMP_ID, host.catalogue, host.bus)
        assert (back.release, version(host)) == (2, "2.0")
        forward = await install(folders[3], host.catalogue, host.bus)
        assert (forward.release, version(host)) == (3, "3.0")
        await uninstall(LAMP_ID, host.catalogue, host.bus)
        assert not left_over(host.folders)
        assert not host.snapshot.drives


async def test_install_that_fails_leaves_the_one_before(tmp_path: Path) -> None:
    first = lamp(tmp_path, 1) / "nondum" / LAMP_ID
    part = Part("lamp", "import no_such_module", PluginDescription("test-lamp", "2.0"))
    broken = make_payload(tmp_path / "drive-2", part, payload_id=LAMP_ID, release=2)
    async with host_in_process(tmp_path, timing=QUICK) as host:
        await install(first, host.catalogue, host.bus)
        with pytest.raises(PayloadRefused):
            await install(broken, host.catalogue, host.bus)
        await host.until_releases(LAMP_ID, r1=Step.ACTIVE, r2=None)
        with pytest.raises(InstallFailed) as refused:
            await go_back(LAMP_ID, host.catalogue, host.bus)
        assert refused.value.code == "ROLLBACK_NOTHING"


async def test_older_drive_is_let_pass_once(tmp_path: Path) -> None:
    older, newer = lamp(tmp_path, 1), lamp(tmp_path, 2)
    async with host_in_process(tmp_path, timing=QUICK) as host:
        host.plug(newer, "b")
        await host.until_releases(LAMP_ID, r2=Step.ACTIVE)
        host.plug(older, "a")
        await host.until_releases(LAMP_ID, r1=Step.REFUSED, r2=Step.ACTIVE)
        back = await go_back(LAMP_ID, host.catalogue, host.bus)
        assert (back.release, version(host)) == (1, "1.0")
        await host.until_releases(LAMP_ID, r1=Step.ACTIVE, r2=Step.SUPERSEDED)
        host.pull("a")
        await host.until_releases(LAMP_ID, r1=None, r2=Step.ACTIVE)
        host.plug(older, "a")
        await host.until_releases(LAMP_ID, r1=Step.REFUSED, r2=Step.ACTIVE)

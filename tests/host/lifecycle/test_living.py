"""Payloads that come and go on a real store, with real workers."""

from __future__ import annotations

import asyncio
import os
import signal
from pathlib import Path

import pytest
from tests.kit.clock import VirtualClock
from tests.kit.host import HOST, LAMP, HostInProcess, host_in_process, left_over
from tests.kit.payloads import Part, make_payload

from nondum.host.catalogue.catalogue import Catalogue
from nondum.host.core.events.daemon import HostStable
from nondum.host.core.events.drives import DrivesScanned
from nondum.host.core.events.event import Emit, Event
from nondum.host.core.events.mounts import MountSet
from nondum.host.core.events.payloads import PayloadActivated
from nondum.host.core.records.component import ComponentState
from nondum.host.core.records.step import Step
from nondum.host.core.state import HostState
from nondum.host.lifecycle.crash_attribution import STEADY_S
from nondum.host.manager.initial_components import install, uninstall
from nondum.host.manager.install_options import InstallOptions
from nondum.host.manager.state_folders import Folders
from nondum.sdk.errors import PayloadRefused

pytestmark = pytest.mark.anyio

LAMP_ID = "org.example.lamp"


def lamp(drive: Path, id: str = "lamp", payload_id: str = LAMP_ID, manifest: str = "") -> Path:
    return make_payload(drive, Part(id, LAMP, manifest=manifest), payload_id=payload_id)


async def test_payload_comes_alive_and_leaves_nothing(tmp_path: Path) -> None:
    lamp(tmp_path / "drive")
    async with host_in_process(tmp_path) as host:
        host.plug(tmp_path / "drive")
        record = await host.until_step(LAMP_ID, Step.ACTIVE)
        assert list(record.phases) == ["seen", "verified", "installed", "ready"]
        component = host.snapshot.component("lamp")
        assert component is not None
        assert component.is_ready
        assert component.description.units[0].name == "lamp"
        pid = host.workers.pids()["lamp"]
        host.pull()
        await host.until_gone(LAMP_ID)
        assert not host.snapshot.components
        assert not host.snapshot.mounts
        assert not left_over(host.folders)
        assert not is_running(pid)
        assert len(await host.executor.installation.listing()) == 4


async def test_pulled_payload_is_withdrawn_with_its_drive(tmp_path: Path) -> None:
    """In one commit: nothing is waited for, no worker and no folder."""
    lamp(tmp_path / "drive")
    async with host_in_process(tmp_path) as host:
        host.plug(tmp_path / "drive")
        await host.until_step(LAMP_ID, Step.ACTIVE)
        host.pull()
        await host.until(lambda: not host.snapshot.drives)
        assert not host.snapshot.components
        await host.until_gone(LAMP_ID)


async def test_known_payload_is_not_copied_again(tmp_path: Path) -> None:
    lamp(tmp_path / "drive")
    async with host_in_process(tmp_path) as host:
        for _ in range(2):
            host.plug(tmp_path / "drive")
            await host.until_step(LAMP_ID, Step.ACTIVE)
            host.pull()
            await host.until_gone(LAMP_ID)
        copied = [e.detail for e in await host.journal() if e.event == "PayloadCopied"]
        assert copied[0]["bytes_copied"] > 0
        assert copied[0]["bytes_known"] == 0
        assert copied[1]["bytes_copied"] == 0
        assert copied[1]["bytes_known"] == copied[0]["bytes_copied"]


async def test_what_can_wait_does_not_pile_up_while_drives_come_and_go(tmp_path: Path) -> None:
    folder = make_payload(tmp_path / "drive", Part("lamp", LAMP), requires='python = ">=9"')
    async with host_in_process(tmp_path) as host:

        async def come_and_go() -> None:
            host.plug(tmp_path / "drive")
            await host.until_step(folder.name, Step.REFUSED)
            host.pull()
            await host.until_gone(folder.name)

        await come_and_go()
        before = len(asyncio.all_tasks())
        for _ in range(10):
            await come_and_go()
        assert len(asyncio.all_tasks()) <= before + 1


async def test_two_payloads_on_one_drive_are_two(tmp_path: Path) -> None:
    lamp(tmp_path / "drive")
    lamp(tmp_path / "drive", "torch", "org.example.torch")
    async with host_in_process(tmp_path) as host:
        host.plug(tmp_path / "drive")
        await host.until_step(LAMP_ID, Step.ACTIVE)
        await host.until_step("org.example.torch", Step.ACTIVE)
        host.pull()
        await host.until_gone(LAMP_ID)
        await host.until_gone("org.example.torch")
        assert not left_over(host.folders)


async def test_one_payload_on_two_drives_leaves_with_the_last(tmp_path: Path) -> None:
    lamp(tmp_path / "drive")
    async with host_in_process(tmp_path) as host:
        host.plug(tmp_path / "drive", "a")
        host.plug(tmp_path / "drive", "b")
        await host.until_step(LAMP_ID, Step.ACTIVE)
        await host.until(lambda: _drives(host) == ("a", "b"))
        host.pull("a")
        await host.until(lambda: _drives(host) == ("b",))
        assert host.snapshot.component("lamp") is not None
        host.pull("b")
        await host.until_gone(LAMP_ID)


async def test_replug_in_a_hurry_ends_alive(tmp_path: Path) -> None:
    lamp(tmp_path / "drive")
    async with host_in_process(tmp_path) as host:
        for _ in range(5):
            host.plug(tmp_path / "drive")
            await host.until(lambda: host.payload(LAMP_ID) is not None)
            host.pull()
        host.plug(tmp_path / "drive")
        await host.until(lambda: host.snapshot.component("lamp") is not None)
        await host.until_step(LAMP_ID, Step.ACTIVE)


async def test_restarted_daemon_brings_back_what_was_active(tmp_path: Path) -> None:
    lamp(tmp_path / "drive")
    async with host_in_process(tmp_path) as host:
        host.plug(tmp_path / "drive")
        await host.until_step(LAMP_ID, Step.ACTIVE)
    async with host_in_process(tmp_path) as host:
        await host.until(lambda: host.snapshot.component("lamp") is not None)
        await host.until_step(LAMP_ID, Step.ACTIVE)
        assert not host.catalogue.state.tries, "the one before was told to end"
        assert "Recovered" in [entry.event for entry in await host.journal()]


async def test_drive_pulled_while_the_daemon_is_down_is_withdrawn(tmp_path: Path) -> None:
    lamp(tmp_path / "drive")
    async with host_in_process(tmp_path) as host:
        host.plug(tmp_path / "drive")
        await host.until_step(LAMP_ID, Step.ACTIVE)
    (host.slots / "a").unlink()
    async with host_in_process(tmp_path) as host:
        await host.until_gone(LAMP_ID)
        assert not left_over(host.folders)


async def test_installed_payload_needs_no_drive(tmp_path: Path) -> None:
    folder = lamp(tmp_path / "drive")
    async with host_in_process(tmp_path) as host:
        await install(folder, host.catalogue, host.bus)
    async with host_in_process(tmp_path) as host:
        await host.until(lambda: host.snapshot.component("lamp") is not None)
        assert host.snapshot.components[0].rank < 1_000_000
        await uninstall(LAMP_ID, host.catalogue, host.bus)
        assert not left_over(host.folders)
        assert not host.snapshot.drives


async def test_refused_install_leaves_nothing(tmp_path: Path) -> None:
    folder = lamp(tmp_path / "drive", manifest="colour = 3")
    async with host_in_process(tmp_path) as host:
        with pytest.raises(PayloadRefused) as refused:
            await install(folder, host.catalogue, host.bus)
        assert refused.value.code == "MANIFEST_KEY"
        await host.until(lambda: not host.snapshot.drives and not host.snapshot.payloads)
        assert not left_over(host.folders)


async def test_pip_installs_the_same_payload(tmp_path: Path) -> None:
    lamp(tmp_path / "drive")
    options = InstallOptions(allow_unsigned=True, method="pip")
    async with host_in_process(tmp_path, options=options) as host:
        host.plug(tmp_path / "drive")
        await host.until_step(LAMP_ID, Step.ACTIVE)
        assert not await host.executor.installation.listing()


async def test_unsigned_payload_needs_leave(tmp_path: Path) -> None:
    lamp(tmp_path / "drive")
    async with host_in_process(tmp_path, options=InstallOptions()) as host:
        host.plug(tmp_path / "drive")
        record = await host.until_step(LAMP_ID, Step.REFUSED)
        assert [problem.code for problem in record.problems] == ["SIG_MISSING"]


async def test_worker_that_dies_is_started_again(tmp_path: Path) -> None:
    lamp(tmp_path / "drive")
    async with host_in_process(tmp_path) as host:
        host.plug(tmp_path / "drive")
        await host.until_step(LAMP_ID, Step.ACTIVE)

        os.kill(host.workers.pids()["lamp"], signal.SIGKILL)
        await host.until(lambda: _state(host) is ComponentState.RESTARTING)
        await host.until(lambda: _state(host) is ComponentState.READY)


async def test_journal_tells_the_way_of_a_payload(tmp_path: Path) -> None:
    lamp(tmp_path / "drive")
    async with host_in_process(tmp_path) as host:
        host.plug(tmp_path / "drive")
        await host.until_step(LAMP_ID, Step.ACTIVE)
        told = await host.catalogue.journal(subject=LAMP_ID)
        assert [entry.step for entry in told if entry.step] == [
            *("received", "copied", "verified", "staged", "stored", "probed", "active"),
        ]


async def test_mounts_come_with_the_payload_and_a_person_overrules_them(tmp_path: Path) -> None:
    unit = "spot__lamp__lamp"
    lamp(tmp_path / "drive", manifest='[[component.unit]]\nname = "lamp"\nxyz = [0, 0, 1]\n')
    async with host_in_process(tmp_path) as host:
        host.plug(tmp_path / "drive")
        await host.until_step(LAMP_ID, Step.ACTIVE)
        assert _height(host, unit) == 1.0
        host.bus.emit(MountSet(unit, (0.0, 0.0, 2.0), (0.0, 0.0, 0.0)))
        await host.until(lambda: _height(host, unit) == 2.0)
        host.pull()
        await host.until_gone(LAMP_ID)
        assert _height(host, unit) == 2.0


def is_running(pid: int) -> bool:
    return Path(f"/proc/{pid}").exists()


def _drives(host: HostInProcess) -> tuple[str, ...]:
    record = host.payload(LAMP_ID)
    return record.drives if record else ()


def _state(host: HostInProcess) -> ComponentState | None:
    component = host.snapshot.component("lamp")
    return component.state if component else None


def _height(host: HostInProcess, unit: str) -> float | None:
    pose = host.snapshot.mount(unit)
    return pose.xyz[2] if pose else None


async def test_daemon_that_lives_on_clears_what_was_counted(
    tmp_path: Path, clock: VirtualClock
) -> None:
    catalogue = await Catalogue.open(Folders(tmp_path / "state").catalogue, HOST)
    await catalogue.commit(HostState(HOST, tries={"what never came again": 4}), ())
    await catalogue.close()
    async with host_in_process(tmp_path) as host:
        await host.until(lambda: any(isinstance(event, DrivesScanned) for event in host.heard))
        await clock.advance(STEADY_S * 0.9)
        assert host.catalogue.state.tries
        await clock.advance(STEADY_S * 0.1)
        await host.until(lambda: not host.catalogue.state.tries)
        assert "HostStable" in [entry.event for entry in await host.journal()]


async def test_nothing_is_cleared_before_it_is_known_what_is_plugged_in(
    tmp_path: Path, clock: VirtualClock
) -> None:
    catalogue = await Catalogue.open(Folders(tmp_path / "state").catalogue, HOST)
    await catalogue.commit(HostState(HOST, tries={"block:a": 4, "what was on it": 4}), ())
    await catalogue.close()
    slow = SlowSource()
    async with host_in_process(tmp_path, sources=lambda folders: (slow,)) as host:
        await host.until(lambda: any(isinstance(event, DrivesScanned) for event in host.heard))
        await clock.advance(STEADY_S * 20)
        assert host.catalogue.state.tries
        slow.may_go_on.set()
        await host.until(lambda: DrivesScanned(slow.kind, ("a",)) in host.heard)
        await clock.advance(STEADY_S)
        await host.until(lambda: not host.catalogue.state.tries)
        order = [type(event) for event in host.heard]
        assert order[: order.index(HostStable)].count(DrivesScanned) == len(("slot", "block"))


class SlowSource:
    """A source of drives that looks once it may."""

    kind = "block"

    def __init__(self) -> None:
        self.may_go_on = asyncio.Event()

    async def watch(self, emit: Emit) -> None:
        await self.may_go_on.wait()
        emit(DrivesScanned(self.kind, ("a",)))
        await asyncio.Event().wait()


async def test_a_plug_is_four_commits_at_most(tmp_path: Path) -> None:
    """Inserted, found, stored, active: what recovery tells apart."""
    lamp(tmp_path / "drive")
    async with host_in_process(tmp_path) as host:
        await host.until(lambda: host.catalogue.commits == 2)  # it has started, and has scanned
        before, when_active = host.catalogue.commits, list[int]()

        def note(event: Event) -> None:
            if isinstance(event, PayloadActivated):
                when_active.append(host.catalogue.commits)

        host.bus.subscribe(note)
        host.plug(tmp_path / "drive")
        await host.until_step(LAMP_ID, Step.ACTIVE)
        await host.until(lambda: bool(when_active))
        assert when_active[0] - before <= 4

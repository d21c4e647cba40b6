"""A drive is pulled at every phase, and in the middle of things: all of it is undone."""

from __future__ import annotations

import asyncio
import random
from pathlib import Path

import pytest
from tests.faults.model import processes_of
from tests.faults.ways import LAMP_ID, sound
from tests.kit.host import LAMP, HostInProcess, host_in_process, left_over
from tests.kit.payloads import Part, make_payload

from nondum.host import events
from nondum.host.catalogue.records import Step
from nondum.host.events import Event

pytestmark = pytest.mark.anyio

GOOD = "org.example.good"

PHASES: tuple[type[Event], ...] = (
    events.DriveInserted,
    events.PayloadFound,
    events.DriveRead,
    events.PayloadCopied,
    events.PayloadVerified,
    events.PayloadStaged,
    events.WheelsStored,
    events.ProgressMade,
    events.ComponentsProbed,
    events.PayloadActivated,
)


async def check_undone(host: HostInProcess, root: Path) -> None:
    """Nothing of the lamp is left, and the good payload never noticed."""
    await host.until(lambda: "a" not in {drive.id for drive in host.snapshot.drives})
    # It went with its drive, in one commit: nothing was waited for, no worker and no folder.
    assert host.snapshot.component("lamp") is None
    await host.until_gone(LAMP_ID)
    (good,) = (p.key for p in host.snapshot.payloads)
    kept = {good, "good"}
    assert {path.name for path in left_over(host.folders)} <= kept
    assert set(host.workers.pids()) == {"good"}
    scratches = [path for path in host.folders.scratches.iterdir() if path.name != good]
    for scratch in (*scratches, host.folders.venvs("lamp")):
        assert not await asyncio.to_thread(processes_of, scratch)


async def plug_good(host: HostInProcess, root: Path) -> None:
    make_payload(root / "good", Part("good", LAMP), payload_id=GOOD)
    host.plug(root / "good", "good")
    await host.until_step(GOOD, Step.ACTIVE)


@pytest.mark.parametrize("phase", PHASES, ids=lambda phase: phase.__name__)
async def test_pull_at_a_phase(tmp_path: Path, phase: type[Event]) -> None:
    sound(tmp_path / "drive")
    async with host_in_process(tmp_path) as host:
        await plug_good(host, tmp_path)
        host.heard.clear()
        host.plug(tmp_path / "drive")
        await host.until(lambda: any(type(event) is phase for event in host.heard))
        host.pull()
        await check_undone(host, tmp_path)


@pytest.mark.slow
async def test_pull_at_any_moment(tmp_path: Path) -> None:
    sound(tmp_path / "drive")
    moments = random.Random(11)
    async with host_in_process(tmp_path) as host:
        await plug_good(host, tmp_path)
        for _ in range(12):
            host.plug(tmp_path / "drive")
            await asyncio.sleep(moments.uniform(0.0, 0.4))
            host.pull()
            await check_undone(host, tmp_path)


async def test_pull_in_the_middle_of_a_behaviour(tmp_path: Path) -> None:
    sound(tmp_path / "drive")
    async with host_in_process(tmp_path) as host:
        await plug_good(host, tmp_path)
        host.plug(tmp_path / "drive")
        await host.until_step(LAMP_ID, Step.ACTIVE)
        host.workers.behave("lamp", "shine", {"u": "spot__lamp__lamp"})
        established = events.BehaviourEstablished
        await host.until(lambda: any(type(event) is established for event in host.heard))
        host.pull()
        await check_undone(host, tmp_path)
        ended = [event for event in host.heard if isinstance(event, events.BehaviourEnded)]
        assert [event.component for event in ended] == ["lamp"]

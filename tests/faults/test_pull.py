"""A drive is pulled at every phase, and in the middle of things: all of it is undone."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest
from tests.faults.model import processes_of
from tests.faults.ways import LAMP_ID, sound
from tests.kit.host import LAMP, HostInProcess, host_in_process, left_over
from tests.kit.payloads import Part, make_payload

from nondum.host.core.events.behaviours import BehaviourEnded, BehaviourEstablished
from nondum.host.core.events.drives import DriveInserted, DriveRead
from nondum.host.core.events.event import Event
from nondum.host.core.events.payloads import (
    ComponentsProbed,
    PayloadActivated,
    PayloadCopied,
    PayloadFound,
    PayloadStaged,
    PayloadVerified,
    ProgressMade,
    WheelsStored,
)
from nondum.host.core.records.step import Step

pytestmark = pytest.mark.anyio

GOOD = "org.example.good"

PHASES: tuple[type[Event], ...] = (
    DriveInserted,
    PayloadFound,
    DriveRead,
    PayloadCopied,
    PayloadVerified,
    PayloadStaged,
    WheelsStored,
    ProgressMade,
    ComponentsProbed,
    PayloadActivated,
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


async def until_event(host: HostInProcess, kind: type[Event]) -> None:
    await host.until(lambda: any(type(event) is kind for event in host.heard))


async def test_pull_at_each_phase(tmp_path: Path) -> None:
    """At moments that no event tells of, too: `python -m tests.faults.drive_figures yanks`."""
    async with host_in_process(tmp_path) as host:
        await plug_good(host, tmp_path)
        for number, phase in enumerate(PHASES, start=1):
            # Each drive has another wheel: one that is in the store already is not stored again.
            lamp, drive = Part("lamp", f"{LAMP}\n# {number}"), tmp_path / f"drive{number}"
            make_payload(drive, lamp, payload_id=LAMP_ID, release=number)
            host.heard.clear()
            host.plug(drive)
            await until_event(host, phase)
            host.pull()
            await check_undone(host, tmp_path)


async def test_pull_in_the_middle_of_a_behaviour(tmp_path: Path) -> None:
    sound(tmp_path / "drive")
    async with host_in_process(tmp_path) as host:
        await plug_good(host, tmp_path)
        host.plug(tmp_path / "drive")
        await host.until_step(LAMP_ID, Step.ACTIVE)
        host.workers.behave("lamp", "shine", {"u": "spot__lamp__lamp"})
        await until_event(host, BehaviourEstablished)
        host.pull()
        await check_undone(host, tmp_path)
        ended = [event for event in host.heard if isinstance(event, BehaviourEnded)]
        assert [event.component for event in ended] == ["lamp"]

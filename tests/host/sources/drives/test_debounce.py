"""What comes and goes is told at once at first; a bad cable waits until it holds."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Sequence
from pathlib import Path

import pytest

from nondum.host.core.events.drives import DriveFlapping, DriveInserted, DriveRemoved, DrivesScanned
from nondum.host.core.events.event import Emit, Event
from nondum.host.sources.drives import debounce
from nondum.host.sources.drives.debounce import FREE_FLAPS, SHORT_STAY_S, Debounced

pytestmark = pytest.mark.anyio


class Cable:
    """A source that a test plugs and unplugs, with a clock that the test moves on."""

    kind = "block"

    def __init__(self) -> None:
        self.now_s = 100.0
        self.count = 0
        self.emit: Emit = lambda event: None

    async def watch(self, emit: Emit) -> None:
        self.emit = emit
        emit(DrivesScanned(self.kind, ()))
        await asyncio.Event().wait()

    def plug(self, port: str = "1-1") -> str:
        self.count += 1
        drive = f"sdb-{self.count}"
        self.emit(DriveInserted(drive, Path("/mnt") / drive, self.kind, port=port))
        return drive

    def pull(self, drive: str) -> None:
        self.emit(DriveRemoved(drive))

    def flap(self, times: int, port: str = "1-1") -> None:
        for _ in range(times):
            drive = self.plug(port)
            self.now_s += 0.05
            self.pull(drive)
            self.now_s += 0.05


class Told(list[Event]):
    """What was told; `more` is set by what is told of itself, without anything that was done."""

    def __init__(self) -> None:
        super().__init__()
        self.more = asyncio.Event()

    def tell(self, event: Event) -> None:
        self.append(event)
        self.more.set()


@contextlib.asynccontextmanager
async def watched(cable: Cable) -> AsyncIterator[Told]:
    told = Told()
    task = asyncio.create_task(Debounced(cable, lambda: cable.now_s).watch(told.tell))
    await asyncio.sleep(0)
    try:
        yield told
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


@pytest.fixture
def cable(monkeypatch: pytest.MonkeyPatch) -> Cable:
    monkeypatch.setattr(debounce, "FIRST_WAIT_S", 0.01)
    monkeypatch.setattr(debounce, "MOST_WAIT_S", 0.02)
    return Cable()


def names(told: Sequence[Event]) -> list[str]:
    return [event.name for event in told]


async def test_drive_that_is_plugged_in_is_told_at_once(cable: Cable) -> None:
    async with watched(cable) as told:
        drive = cable.plug()
        cable.pull(drive)
        assert names(told) == ["DrivesScanned", "DriveInserted", "DriveRemoved"]


async def test_ten_times_a_second_is_told_once_and_then_read_once_it_stays(cable: Cable) -> None:
    async with watched(cable) as told:
        cable.flap(100)
        assert names(told[1:]) == ["DriveInserted", "DriveRemoved"] * FREE_FLAPS + ["DriveFlapping"]
        flapping = told[-1]
        assert isinstance(flapping, DriveFlapping)
        assert [problem.code for problem in flapping.problems] == ["DRIVE_FLAPPING"]
        told.more.clear()
        drive = cable.plug()
        assert names(told)[-1] == "DriveFlapping"
        async with asyncio.timeout(60):
            await told.more.wait()
        assert isinstance(told[-1], DriveInserted)
        cable.now_s += SHORT_STAY_S
        cable.pull(drive)
        assert told[-1:] == [DriveRemoved(drive)]


async def test_other_ports_are_not_made_to_wait(cable: Cable) -> None:
    async with watched(cable) as told:
        cable.flap(20)
        drive = cable.plug("1-2")
        assert isinstance(told[-1], DriveInserted)
        assert told[-1].drive == drive


async def test_port_that_was_good_for_long_is_forgiven(cable: Cable) -> None:
    async with watched(cable) as told:
        cable.flap(20)
        cable.now_s += debounce.FORGIVEN_S + 1
        cable.plug()
        assert isinstance(told[-1], DriveInserted)


async def test_people_who_replug_are_not_made_to_wait(cable: Cable) -> None:
    async with watched(cable) as told:
        for _ in range(20):
            drive = cable.plug()
            cable.now_s += SHORT_STAY_S
            cable.pull(drive)
        assert names(told[1:]) == ["DriveInserted", "DriveRemoved"] * 20

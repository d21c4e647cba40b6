"""Payloads that were refused for what can go away are tried again once it is gone."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator
from dataclasses import replace

import pytest
from tests.host.lifecycle.states import active, after, component, drive, way_to_active
from tests.host.sources.devices.sightings import serial_adapter
from tests.kit.clock import VirtualClock
from tests.kit.golden import Golden

from nondum.host.core import effects
from nondum.host.core.events.devices import DeviceAppeared
from nondum.host.core.events.drives import DriveRetried
from nondum.host.core.events.event import Event
from nondum.host.core.events.payloads import PayloadRefused, RetryAsked
from nondum.host.core.events.trust import TrustChanged
from nondum.host.core.events.workers import WorkerFailed
from nondum.host.core.records.component import ComponentState
from nondum.host.core.records.device import DeviceClaim
from nondum.host.core.records.drive import DriveRecord, DriveState
from nondum.host.core.records.snapshot import Snapshot
from nondum.host.core.records.step import Step
from nondum.host.core.state import HostState
from nondum.host.lifecycle.retry_causes import (
    FIRST_S,
    LONGEST_S,
    MOST_READINGS,
    Amounts,
    Unread,
    drives_due,
)
from nondum.host.manager.refusal_retry import LOOK_S, RefusalRetry
from nondum.host.people.announcements import announced
from nondum.host.sources.devices.hardware import devices
from nondum.sdk.errors import Problem

pytestmark = pytest.mark.anyio

LITTLE = Amounts(disk_mb=7, memory_mb=7, gpu_memory_mb=7, clock_s=1000.0)
MUCH = Amounts(disk_mb=10, memory_mb=10, gpu_memory_mb=10, clock_s=2000.0)
FULL = Problem("DISK_FULL", "made up", need="10 MB", have="7 MB", fix="free some disk")
PASSING = ("DISK_FULL", "NO_MEMORY", "NO_GPU_MEMORY", "SIG_NOT_YET", "SIG_EXPIRED")


def refused(*problems: Problem) -> HostState:
    return after(drive(), way_to_active()[0], PayloadRefused("k1", problems))[0]


class Host:
    """A state, what the host has, and who looks at both."""

    def __init__(self, *problems: Problem) -> None:
        self.state, self.has = refused(*problems), LITTLE
        self.elsewhere: tuple[str, ...] = ()
        self.asked: list[Event] = []

    @contextlib.asynccontextmanager
    async def watched(self) -> AsyncIterator[None]:
        looking = RefusalRetry(
            lambda: Snapshot("spot", 1, payloads=tuple(self.state.payloads.values())),
            self._amounts,
            self.asked.append,
            lambda: self.elsewhere,
        )
        task = asyncio.create_task(looking.run())
        try:
            yield
        finally:
            task.cancel()

    async def _amounts(self) -> Amounts:
        return self.has


@pytest.mark.parametrize("code", PASSING)
async def test_payload_is_tried_again_once_its_cause_is_gone(
    code: str, clock: VirtualClock
) -> None:
    host = Host(replace(FULL, code=code, need="10 MB" if "SIG" not in code else ""))
    async with host.watched():
        await clock.advance(100)
        assert not host.asked
        host.has = MUCH
        await clock.advance(LOOK_S)
    assert [type(event) for event in host.asked] == [RetryAsked]


async def test_more_than_there_was_is_not_enough_where_the_need_is_known(
    clock: VirtualClock,
) -> None:
    known, unknown = Host(FULL), Host(replace(FULL, need=""))
    async with known.watched(), unknown.watched():
        await clock.advance(LOOK_S)
        known.has = unknown.has = replace(LITTLE, disk_mb=9)
        await clock.advance(FIRST_S + LOOK_S)
    assert (len(known.asked), len(unknown.asked)) == (0, 1)


async def test_failed_attempts_come_later_and_later(clock: VirtualClock) -> None:
    host = Host(FULL)
    host.has = MUCH
    async with host.watched():
        await clock.advance(60)
        assert len(host.asked) == 3
        await clock.advance(3600)
        soon = len(host.asked)
        await clock.advance(3600)
    assert soon <= 12
    assert len(host.asked) - soon <= 3600 / LONGEST_S


async def test_payload_that_comes_and_is_refused_again_is_counted_on(clock: VirtualClock) -> None:
    host = Host(FULL)
    host.has = MUCH
    async with host.watched():
        for _ in range(3):
            asked = len(host.asked)
            while len(host.asked) == asked:
                await clock.advance(LOOK_S)
            host.state, was = HostState("spot"), host.state
            await clock.advance(LOOK_S)
            host.state = was
        now = len(host.asked)
        await clock.advance(FIRST_S * 3)
    assert len(host.asked) == now


async def test_payload_that_runs_on_a_peer_stays_there(clock: VirtualClock) -> None:
    host = Host(FULL)
    host.has, host.elsewhere = MUCH, ("k1",)
    async with host.watched():
        await clock.advance(100)
    assert not host.asked


async def test_refusal_of_which_one_cause_stays_is_left(clock: VirtualClock) -> None:
    host = Host(FULL, Problem("WHEEL_RECORD", "made up"))
    host.has = MUCH
    async with host.watched():
        await clock.advance(100)
    assert not host.asked


@pytest.mark.parametrize(
    ("code", "said"),
    [
        ("DISK_FULL", "free some disk; then it is tried again by itself"),
        ("IO_ERROR", "free some disk; then `nondum retry org.x`"),
        ("WHEEL_RECORD", "free some disk"),
    ],
)
def test_refusal_says_what_comes_of_it_once_it_is_mended(code: str, said: str) -> None:
    state = refused(replace(FULL, code=code))
    assert [problem.fix for problem in state.payloads["k1"].problems] == [said]


def test_installation_that_is_given_up_is_not_said_to_be_tried_again() -> None:
    way = (drive(kind="installed"), way_to_active()[0], PayloadRefused("k1", (FULL,)))
    assert after(*way)[0].payloads["k1"].problems == (FULL,)


def test_people_are_told_why_it_is_tried_again(golden: Golden) -> None:
    state = refused(FULL)
    snapshot = Snapshot("spot", 1, payloads=tuple(state.payloads.values()))
    assert announced(RetryAsked("k1"), snapshot) is None
    told = announced(RetryAsked("k1", "there is disk"), snapshot)
    golden.check("a payload is tried again", told or "")


def test_payload_that_is_not_trusted_is_tried_again_when_trust_changes() -> None:
    untrusted = refused(Problem("SIG_UNTRUSTED", "made up"))
    state, done = after(TrustChanged("survey", 2, "person"), state=untrusted)
    assert state.payloads["k1"].step is Step.REMOVING
    assert effects.ClearPayload("k1", ()) in done
    other = after(TrustChanged("survey", 2, "person"), state=refused(FULL))[0]
    assert other.payloads["k1"].step is Step.REFUSED


def test_component_that_failed_is_started_again_with_the_device_that_comes_back() -> None:
    (line,) = devices(serial_adapter()).values()
    eye = replace(
        component(need="any"), devices=(DeviceClaim("port", {"usb": "0403:6001"}, False),)
    )
    failed = WorkerFailed("eye", (FULL,), "k1")
    state = after(failed, state=replace(active(), components={"eye": eye}))[0]
    assert state.components["eye"].state is ComponentState.QUARANTINED
    state, done = after(DeviceAppeared(line.id, line), state=state)
    assert state.components["eye"].state is ComponentState.RESTARTING
    assert effects.RestartWorker("eye") in done


def silent(code: str = "HELPER_SILENT", state: DriveState = DriveState.IDLE) -> DriveRecord:
    return replace(
        after(drive("d"))[0].drives["d"], state=state, problems=(Problem(code, "made up"),)
    )


@pytest.mark.parametrize("code", ["HELPER_SILENT", "HELPER_BUSY"])
def test_drive_that_the_helper_did_not_get_to_is_read_again_later_and_later(code: str) -> None:
    unread: dict[str, Unread] = {}
    at_s, wait_s = 0.0, FIRST_S
    for _ in range(MOST_READINGS):
        unread, again = drives_due(unread, [silent(code)], at_s)
        assert again == ()
        unread, again = drives_due(unread, [silent(code)], at_s + wait_s)
        assert again == ("d",)
        at_s, wait_s = at_s + wait_s, wait_s * 2
    assert drives_due(unread, [silent(code)], at_s + LONGEST_S)[1] == ()


def test_readings_are_counted_while_the_drive_is_read() -> None:
    before = {"d": Unread(5.0, 3)}
    assert drives_due(before, [silent(state=DriveState.READING)], 9.0) == (before, ())


@pytest.mark.parametrize("drives", [[], [replace(silent(), problems=())], [silent("IO_ERROR")]])
def test_drive_that_could_be_read_or_is_gone_begins_from_the_start(
    drives: list[DriveRecord],
) -> None:
    assert drives_due({"d": Unread(5.0, 3)}, drives, 9.0) == ({}, ())


def test_unread_drive_is_read_when_it_is_due() -> None:
    state = replace(after(drive("d"))[0], drives={"d": silent()})
    state, done = after(DriveRetried("d", "the helper may answer now"), state=state)
    assert state.drives["d"].state is DriveState.READING
    assert any(isinstance(effect, effects.ReadDrive) for effect in done)


def test_drive_that_is_being_read_is_not_read_twice() -> None:
    state = replace(after(drive("d"))[0], drives={"d": silent(state=DriveState.READING)})
    assert after(DriveRetried("d", "the helper may answer now"), state=state)[1] == []

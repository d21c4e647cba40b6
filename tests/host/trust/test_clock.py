"""A clock that cannot be right is said while it is wrong, and not after."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from datetime import datetime, timedelta

import pytest
from tests.host.trust.trusted import FIRST
from tests.kit.clock import VirtualClock

from nondum.host.core.events.event import Event
from nondum.host.core.events.trust import ClockDoubted
from nondum.host.core.records.snapshot import Snapshot
from nondum.host.people.announcements import announced
from nondum.host.trust.clock import LOOK_S, ClockWatch
from nondum.wheelhouse.trust.judging import EARLIEST
from nondum.wheelhouse.trust.trust import Trust

pytestmark = pytest.mark.anyio

TODAY = EARLIEST + timedelta(days=90)
BEHIND = EARLIEST - timedelta(days=20 * 365)
YESTERDAY = TODAY - timedelta(days=1)
MADE_TODAY = replace(FIRST, made=TODAY)


class Machine:
    """A clock that is set, and what the host tells of it."""

    def __init__(self, trust: Trust | None, now: datetime) -> None:
        self.trust, self.now = trust, now
        self.told: list[Event] = []
        self.watch = ClockWatch(lambda: self.trust, self.told.append, lambda: self.now)

    @property
    def codes(self) -> list[str]:
        return [problem.code for problem in self.watch.problems]

    @property
    def names(self) -> list[str]:
        return [event.name for event in self.told]


@pytest.mark.parametrize(
    ("trust", "now", "codes"),
    [
        (MADE_TODAY, BEHIND, ["CLOCK_UNSURE"]),
        (MADE_TODAY, YESTERDAY, ["CLOCK_UNSURE"]),
        (MADE_TODAY, TODAY, []),
        (None, BEHIND, ["CLOCK_UNSURE"]),
        (None, YESTERDAY, []),
    ],
    ids=["20 years", "before the trust file", "right", "before nondum", "no trust file"],
)
def test_clock_is_held_against_what_is_certainly_past(
    trust: Trust | None, now: datetime, codes: list[str]
) -> None:
    machine = Machine(trust, now)
    assert machine.codes == codes
    assert all(problem.fix for problem in machine.watch.problems)


async def test_wrong_clock_is_told_once_and_so_is_that_it_was_set(clock: VirtualClock) -> None:
    machine = Machine(MADE_TODAY, BEHIND)
    watching = asyncio.create_task(machine.watch.run())
    await clock.advance(10 * LOOK_S)
    assert machine.names == ["ClockDoubted"]
    machine.now = TODAY
    assert not machine.codes
    await clock.advance(LOOK_S)
    assert machine.names == ["ClockDoubted", "ClockRight"]
    machine.trust = replace(FIRST, made=TODAY + timedelta(days=1))
    await clock.advance(LOOK_S)
    assert machine.names == ["ClockDoubted", "ClockRight", "ClockDoubted"]
    watching.cancel()
    snapshot = Snapshot("spot", 1)
    assert all(announced(event, snapshot) for event in machine.told)
    first = machine.told[0]
    assert isinstance(first, ClockDoubted)
    assert [problem.code for problem in first.problems] == ["CLOCK_UNSURE"]


async def test_clock_that_is_right_is_not_spoken_of(clock: VirtualClock) -> None:
    machine = Machine(MADE_TODAY, TODAY)
    watching = asyncio.create_task(machine.watch.run())
    await clock.advance(10 * LOOK_S)
    assert not machine.told
    watching.cancel()

"""Events reach everybody who listens, in order."""

from __future__ import annotations

import logging

import pytest

from nondum.host.core.bus import Bus
from nondum.host.core.events.drives import DriveRemoved
from nondum.host.core.events.event import Event
from nondum.host.core.events.goals import PlanMissing
from nondum.host.lifecycle.advance import RULES

pytestmark = pytest.mark.anyio


def faulty(event: Event) -> None:
    raise RuntimeError("no")


async def test_error_of_a_listener_affects_no_other_one(caplog: pytest.LogCaptureFixture) -> None:
    bus, heard = Bus(RULES), list[Event]()
    bus.subscribe(faulty)
    bus.subscribe(heard.append)
    with caplog.at_level(logging.ERROR):
        bus.emit(PlanMissing("1", ()))
    assert heard == [PlanMissing("1", ())]
    [record] = caplog.records
    assert record.levelno == logging.ERROR
    assert heard[0].name in record.message


async def test_what_changes_the_catalogue_waits_for_its_commit() -> None:
    bus, heard = Bus(RULES), list[Event]()
    bus.subscribe(heard.append)
    bus.emit(DriveRemoved("a"))
    bus.emit(PlanMissing("1", ()))
    assert heard == [PlanMissing("1", ())]
    assert [event for event, _ in await bus.batch()] == [DriveRemoved("a"), PlanMissing("1", ())]


async def test_who_has_left_hears_no_more() -> None:
    bus, heard = Bus(RULES), list[Event]()
    leave = bus.subscribe(heard.append)
    leave()
    bus.emit(PlanMissing("1", ()))
    assert heard == []

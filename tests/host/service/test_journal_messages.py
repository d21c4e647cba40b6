"""What happens goes to the journal under the names by which people look for it."""

from __future__ import annotations

import logging
from pathlib import Path

import pytest
from tests.host.lifecycle.states import active, component
from tests.kit.golden import Golden

from nondum.host.core.events.behaviours import BehaviourStarted
from nondum.host.core.events.drives import DriveInserted
from nondum.host.core.events.event import Event
from nondum.host.core.events.facts import FactKnown
from nondum.host.core.events.payloads import PayloadActivated, PayloadRefused
from nondum.host.core.events.workers import WorkerFailed, WorkerLogged
from nondum.host.core.state import HostState
from nondum.host.service.journal_messages import JournalMessages
from nondum.sdk.errors import Problem

FULL = Problem("DISK_FULL", "the disk is full")
LATE = Problem("WORKER_HUNG", "it does not answer")


@pytest.fixture
def told(caplog: pytest.LogCaptureFixture) -> pytest.LogCaptureFixture:
    caplog.set_level(logging.INFO, logger="nondum.events")
    return caplog


def tell(event: Event, state: HostState | None = None) -> None:
    JournalMessages((state or active()).snapshot).on_event(event)


def fields(told: pytest.LogCaptureFixture) -> list[tuple[str, str]]:
    (record,) = told.records
    found: list[tuple[str, str]] = record.__dict__["journal"]
    return found


def test_refusal_is_found_by_payload_and_by_each_code(told: pytest.LogCaptureFixture) -> None:
    tell(PayloadRefused("k1", (FULL, LATE, FULL)))
    assert fields(told) == [
        ("NONDUM_EVENT", "PayloadRefused"),
        ("NONDUM_PAYLOAD", "org.x"),
        ("NONDUM_CODE", "DISK_FULL"),
        ("NONDUM_CODE", "WORKER_HUNG"),
    ]
    (record,) = told.records
    assert record.levelno == logging.WARNING
    assert "org.x is refused: DISK_FULL" in record.getMessage()


def test_what_is_not_announced_is_logged_all_the_same(
    told: pytest.LogCaptureFixture, golden: Golden
) -> None:
    tell(DriveInserted("sda1", Path("/mnt"), "block"))
    assert ("NONDUM_DRIVE", "sda1") in fields(told)
    told.clear()
    tell(PayloadActivated("k1", (component("eye"),)))
    (record,) = told.records
    assert record.levelno == logging.INFO
    golden.check("a payload is active", record.getMessage())


def test_every_event_with_a_problem_is_told(told: pytest.LogCaptureFixture) -> None:
    tell(WorkerFailed("eye", (LATE,)))
    assert fields(told)[1:] == [("NONDUM_COMPONENT", "eye"), ("NONDUM_CODE", "WORKER_HUNG")]


def test_lines_of_plugins_are_logged_from_warnings_on(told: pytest.LogCaptureFixture) -> None:
    for level in ("info", "stdout", "log"):
        tell(WorkerLogged("eye", level, "I see"))
    assert not told.records
    tell(WorkerLogged("eye", "error", "I do not see"))
    (record,) = told.records
    assert (record.levelno, record.getMessage()) == (logging.ERROR, "eye: I do not see")
    assert ("NONDUM_COMPONENT", "eye") in fields(told)


def test_what_happens_all_the_time_is_not_told(told: pytest.LogCaptureFixture) -> None:
    tell(FactKnown("eye", "seen", ("spot",)))
    tell(BehaviourStarted("eye", "look", 1))
    assert not told.records

"""What people are told of payloads and drives."""

from __future__ import annotations

from pathlib import Path

import pytest

from nondum.host import events
from nondum.host.announcements import announced
from nondum.host.catalogue.records import PayloadRecord, Snapshot, Step
from nondum.host.events import Event
from nondum.sdk.errors import Problem

KEY = "0" * 16
LAMP = PayloadRecord(
    key=KEY,
    digest="0" * 64,
    payload_id="org.example.lamp",
    version="1",
    release=1,
    fleet="",
    step=Step.REMOVING,
    sources={},
    phases={},
)
WRONG = (Problem("PYTHON_VERSION", "needs another Python"), Problem("DISK_FULL", "no room"))


@pytest.mark.parametrize(
    ("event", "said"),
    [
        (
            events.PayloadRefused(KEY, WRONG),
            "org.example.lamp is refused: PYTHON_VERSION needs another Python; DISK_FULL no room",
        ),
        (
            events.PayloadFailed(KEY, WRONG[1:]),
            "org.example.lamp does not work: DISK_FULL no room",
        ),
        (
            events.PayloadWithdrawn(KEY, "its drive was pulled"),
            "org.example.lamp is withdrawn: its drive was pulled",
        ),
        (events.PayloadWithdrawn("1", "it left"), "payload 1 is withdrawn: it left"),
        (events.DriveUnreadable("a", WRONG[1:]), "drive a cannot be used: DISK_FULL no room"),
        (events.DriveRead("a", ()), "drive a carries no payload"),
        (events.DriveRead("a", (KEY,)), None),
        (events.DriveInserted("a", Path("/a"), "slot"), None),
    ],
    ids=lambda value: getattr(value, "name", None),
)
def test_event_is_said_in_a_sentence(event: Event, said: str | None) -> None:
    assert announced(event, Snapshot("spot", revision=1, payloads=(LAMP,))) == said

"""What people are told of payloads and drives."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from nondum.host.core import events
from nondum.host.core.events import Event
from nondum.host.core.records import ComponentRecord, ComponentState, PayloadRecord, Snapshot, Step
from nondum.host.people.announcements import announced
from nondum.sdk.description import PluginDescription
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
WRONG = (
    Problem("PYTHON_VERSION", "needs another Python", fix="use another payload"),
    Problem("DISK_FULL", "the disk is full", fix="free some"),
)


@pytest.mark.parametrize(
    ("event", "said"),
    [
        (
            events.PayloadRefused(KEY, WRONG),
            "org.example.lamp is refused: PYTHON_VERSION needs another Python → use another payload"
            "; DISK_FULL the disk is full → free some",
        ),
        (
            events.PayloadFailed(KEY, WRONG[1:]),
            "org.example.lamp does not work: DISK_FULL the disk is full → free some",
        ),
        (
            events.PayloadWithdrawn(KEY, "its drive was pulled"),
            "org.example.lamp is withdrawn: its drive was pulled",
        ),
        (events.PayloadWithdrawn("1", "it left"), "payload 1 is withdrawn: it left"),
        (
            events.DriveUnreadable("a", WRONG[1:]),
            "drive a cannot be used: DISK_FULL the disk is full → free some",
        ),
        (events.DriveRead("a", ()), "drive a carries no payload"),
        (events.DriveRead("a", (KEY,)), None),
        (events.DriveInserted("a", Path("/a"), "slot"), None),
    ],
    ids=lambda value: getattr(value, "name", None),
)
def test_event_is_said_in_a_sentence(event: Event, said: str | None) -> None:
    assert announced(event, Snapshot("spot", revision=1, payloads=(LAMP,))) == said


def test_release_that_was_refused_unread_is_named_without_a_version() -> None:
    unread = replace(LAMP, key="3" * 16, digest="3" * 64, version="", release=0)
    snapshot = Snapshot("spot", revision=1, payloads=(LAMP, unread))
    gone = events.PayloadWithdrawn(unread.key, "its drive was pulled")
    assert announced(gone, snapshot) == "org.example.lamp is withdrawn: its drive was pulled"


def test_payload_that_was_rebuilt_is_told_as_such_without_a_version() -> None:
    rebuilt = replace(LAMP, key="3" * 16, digest="3" * 64, version="1.1", release=2)
    snapshot = Snapshot("spot", revision=1, payloads=(LAMP, rebuilt))
    gone = events.PayloadWithdrawn(KEY, "it was built again in its place", rebuilt.key)
    assert announced(gone, snapshot) == (
        "org.example.lamp has changed on its drive, and is judged again"
    )


OLD = replace(LAMP, step=Step.ACTIVE)
NEW = replace(LAMP, key="2" * 16, digest="2" * 64, version="2", release=2, step=Step.STORED)


@pytest.mark.parametrize(
    ("event", "step", "said"),
    [
        (
            events.WheelsStored(NEW.key, 1),
            Step.STORED,
            "org.example.lamp 2 is being brought up beside 1",
        ),
        (events.WheelsStored(NEW.key, 1), Step.SUPERSEDED, None),
        (
            events.PayloadFailed(NEW.key, WRONG[1:]),
            Step.QUARANTINED,
            f"org.example.lamp 2 does not work, 1 (release 1) stays: {WRONG[1]}",
        ),
        (
            events.PayloadWithdrawn(NEW.key, "its drive was pulled"),
            Step.REMOVING,
            "org.example.lamp 2 is withdrawn: its drive was pulled, 1 (release 1) stays",
        ),
        (
            events.BesideRefused(NEW.key, "it runs alone"),
            Step.STORED,
            "org.example.lamp 2 takes the place of the release before it, not beside it: "
            "it runs alone",
        ),
        (
            events.RollbackAsked(KEY, 1, 2),
            Step.ACTIVE,
            "a person goes back to org.example.lamp 1 (release 1) from release 2",
        ),
    ],
    ids=lambda value: getattr(value, "name", None),
)
def test_release_is_told_beside_the_one_in_force(
    event: Event, step: Step, said: str | None
) -> None:
    payloads = OLD, replace(NEW, step=step)
    assert announced(event, Snapshot("spot", revision=1, payloads=payloads)) == said


def test_takeover_and_return_are_told() -> None:
    new = replace(NEW, step=Step.ACTIVE, was=1)
    snapshot = Snapshot("spot", revision=2, payloads=(replace(OLD, step=Step.SUPERSEDED), new))
    told = announced(events.PayloadActivated(new.key, ()), snapshot)
    assert told == "org.example.lamp 2 (release 2) took over from release 1"
    lower = replace(new, version="0.9")
    snapshot = replace(snapshot, payloads=(snapshot.payloads[0], lower))
    told = announced(events.PayloadActivated(new.key, ()), snapshot)
    assert told is not None and told.endswith("though its version is lower: 1 was active")
    back = Snapshot("spot", revision=3, payloads=(replace(OLD, step=Step.STORED),))
    told = announced(events.PayloadResumed(KEY, "the release that was active has stopped"), back)
    assert told == ("org.example.lamp 1 comes back: the release that was active has stopped")


def test_people_are_told_what_a_component_may_use() -> None:
    listener = ComponentRecord(
        *("listener", KEY, "org.example.lamp", "test-listener", "test_listener", "1"),
        ComponentState.READY,
        PluginDescription("test-listener", "1"),
        *(Path("/venv"), Path("/site"), Path("/scratch")),
        rank=0,
        permissions=("network", "audio"),
    )
    lamp = replace(LAMP, step=Step.ACTIVE)
    told = announced(
        events.PayloadActivated(KEY, (listener,)), Snapshot("spot", revision=1, payloads=(lamp,))
    )
    assert told == "listener may use: audio, network"

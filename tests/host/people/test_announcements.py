"""What people are told of payloads and drives."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from tests.kit.golden import Golden

from nondum.host.core.events.drives import DriveInserted, DriveRead, DriveUnreadable
from nondum.host.core.events.event import Event
from nondum.host.core.events.payloads import (
    PayloadActivated,
    PayloadFailed,
    PayloadRefused,
    PayloadWithdrawn,
    WheelsStored,
)
from nondum.host.core.events.releases import BesideRefused, PayloadResumed, RollbackAsked
from nondum.host.core.records.component import ComponentRecord, ComponentState
from nondum.host.core.records.payload import PayloadRecord
from nondum.host.core.records.snapshot import Snapshot
from nondum.host.core.records.step import Step
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
GONE = "its drive was pulled"
WRONG = (
    Problem("PYTHON_VERSION", "needs another Python", fix="use another payload"),
    Problem("DISK_FULL", "the disk is full", fix="free some"),
)


def said(event: Event, snapshot: Snapshot) -> str:
    told = announced(event, snapshot)
    assert told is not None
    return told


@pytest.mark.parametrize(
    ("situation", "event"),
    [
        ("a payload is refused", PayloadRefused(KEY, WRONG)),
        ("a payload fails", PayloadFailed(KEY, WRONG[1:])),
        ("a payload is withdrawn", PayloadWithdrawn(KEY, GONE)),
        ("a payload that no record names is withdrawn", PayloadWithdrawn("1", "it left")),
        ("a drive cannot be read", DriveUnreadable("a", WRONG[1:])),
        ("a drive carries nothing", DriveRead("a", ())),
    ],
)
def test_event_is_said_in_a_sentence(situation: str, event: Event, golden: Golden) -> None:
    golden.check(situation, said(event, Snapshot("spot", revision=1, payloads=(LAMP,))))


@pytest.mark.parametrize(
    "event",
    [DriveRead("a", (KEY,)), DriveInserted("a", Path("/a"), "slot")],
    ids=["a payload is found", "a drive is inserted"],
)
def test_event_that_another_follows_is_not_said(event: Event) -> None:
    assert announced(event, Snapshot("spot", revision=1, payloads=(LAMP,))) is None


def test_release_that_was_refused_unread_is_named_without_a_version() -> None:
    unread = replace(LAMP, key="3" * 16, digest="3" * 64, version="", release=0)
    snapshot = Snapshot("spot", revision=1, payloads=(LAMP, unread))
    alone = Snapshot("spot", revision=1, payloads=(LAMP,))
    assert said(PayloadWithdrawn(unread.key, GONE), snapshot) == said(
        PayloadWithdrawn(KEY, GONE), alone
    )


def test_payload_that_was_rebuilt_is_told_as_such_without_a_version(golden: Golden) -> None:
    rebuilt = replace(LAMP, key="3" * 16, digest="3" * 64, version="1.1", release=2)
    snapshot = Snapshot("spot", revision=1, payloads=(LAMP, rebuilt))
    gone = PayloadWithdrawn(KEY, "it was built again in its place", rebuilt.key)
    golden.check("a payload is built again on its drive", said(gone, snapshot))


OLD = replace(LAMP, step=Step.ACTIVE)
NEW = replace(LAMP, key="2" * 16, digest="2" * 64, version="2", release=2, step=Step.STORED)


@pytest.mark.parametrize(
    ("situation", "event", "step"),
    [
        ("another release is stored", WheelsStored(NEW.key, 1), Step.STORED),
        (
            "another release fails",
            PayloadFailed(NEW.key, WRONG[1:]),
            Step.QUARANTINED,
        ),
        (
            "another release is withdrawn",
            PayloadWithdrawn(NEW.key, GONE),
            Step.REMOVING,
        ),
        (
            "another release runs alone",
            BesideRefused(NEW.key, "it runs alone"),
            Step.STORED,
        ),
        ("a person goes back", RollbackAsked(KEY, 1, 2), Step.ACTIVE),
    ],
)
def test_release_is_told_beside_the_active_one(
    situation: str, event: Event, step: Step, golden: Golden
) -> None:
    payloads = OLD, replace(NEW, step=step)
    golden.check(situation, said(event, Snapshot("spot", revision=1, payloads=payloads)))


def test_release_that_is_superseded_already_is_not_told() -> None:
    payloads = OLD, replace(NEW, step=Step.SUPERSEDED)
    snapshot = Snapshot("spot", revision=1, payloads=payloads)
    assert announced(WheelsStored(NEW.key, 1), snapshot) is None


def test_takeover_and_return_are_told(golden: Golden) -> None:
    new = replace(NEW, step=Step.ACTIVE, was=1)
    snapshot = Snapshot("spot", revision=2, payloads=(replace(OLD, step=Step.SUPERSEDED), new))
    golden.check("a release takes over", said(PayloadActivated(new.key, ()), snapshot))
    lower = replace(new, version="0.9")
    snapshot = replace(snapshot, payloads=(snapshot.payloads[0], lower))
    told = said(PayloadActivated(new.key, ()), snapshot)
    golden.check("a release of a lower version takes over", told)
    back = Snapshot("spot", revision=3, payloads=(replace(OLD, step=Step.STORED),))
    told = said(PayloadResumed(KEY, "the release that was active has stopped"), back)
    golden.check("the release before comes back", told)


def test_people_are_told_what_a_component_may_use(golden: Golden) -> None:
    listener = ComponentRecord(
        *("listener", KEY, "org.example.lamp", "test-listener", "test_listener", "1"),
        ComponentState.READY,
        PluginDescription("test-listener", "1"),
        *(Path("/venv"), Path("/site"), Path("/scratch")),
        rank=0,
        permissions=("network", "audio"),
    )
    lamp = replace(LAMP, step=Step.ACTIVE)
    snapshot = Snapshot("spot", revision=1, payloads=(lamp,))
    told = said(PayloadActivated(KEY, (listener,)), snapshot)
    golden.check("a component with permissions is active", told)

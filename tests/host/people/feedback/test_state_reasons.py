"""The reasons for the state that a host shows, from what it knows."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from tests.host.lifecycle.states import component
from tests.kit.golden import Golden

from nondum.host.core.feedback_state import State, StateReason
from nondum.host.core.records.component import ComponentRecord
from nondum.host.core.records.drive import DriveRecord, DriveState
from nondum.host.core.records.payload import PayloadRecord
from nondum.host.core.records.safety import Safety
from nondum.host.core.records.snapshot import Snapshot
from nondum.host.core.records.step import Step
from nondum.host.mind.goals import GivenGoal, GoalState
from nondum.host.people.feedback.state_reasons import Known, state_reasons
from nondum.sdk.errors import Problem

UNSIGNED = Problem("SIG_MISSING", "the payload is not signed")
DRIVE = DriveRecord("sdb1-7", "block", Path("/mnt"), state=DriveState.IDLE)
PAYLOAD = PayloadRecord(
    key="k",
    digest="d",
    payload_id="org.example.eye",
    version="1",
    release=1,
    fleet="",
    step=Step.ACTIVE,
    sources={"sdb1-7": Path("/mnt/nondum/org.example.eye")},
    phases={},
)


def known(*payloads: PayloadRecord, drive: DriveRecord = DRIVE, unmounted: bool = True) -> Known:
    gone = ("sdb1-7",) if unmounted else ()
    return Known(Snapshot("spot", 1, payloads=payloads, drives=(drive,)), gone)


def states(known: Known) -> list[State]:
    return [reason.state for reason in state_reasons(known)]


def at(step: Step, *problems: Problem) -> PayloadRecord:
    return replace(PAYLOAD, step=step, problems=problems)


def test_a_host_without_anything_has_no_state_reasons() -> None:
    assert state_reasons(Known(Snapshot("spot", 1))) == ()


def test_a_drive_with_an_active_payload_may_be_pulled() -> None:
    [safe] = state_reasons(known(PAYLOAD))
    assert (safe.state, safe.drive) == (State.SAFE, "sdb1-7")


@pytest.mark.parametrize("step", [s for s in Step if s not in (Step.ACTIVE, Step.SUPERSEDED)])
def test_no_drive_may_be_pulled_before_its_payload_is_in_force(step: Step) -> None:
    assert State.SAFE not in states(known(at(step)))


def test_one_payload_that_is_not_ready_keeps_the_whole_drive() -> None:
    other = replace(PAYLOAD, key="k2", step=Step.STAGED)
    assert State.SAFE not in states(known(PAYLOAD, other))


def test_a_drive_that_is_mounted_may_not_be_pulled_whatever_is_in_force() -> None:
    assert states(known(PAYLOAD, unmounted=False)) == []


@pytest.mark.parametrize("state", [DriveState.READING, DriveState.COPYING])
def test_a_drive_that_is_read_is_being_worked_on(state: DriveState) -> None:
    assert states(known(PAYLOAD, drive=replace(DRIVE, state=state))) == [State.WORKING]


@pytest.mark.parametrize("step", [Step.RECEIVED, Step.COPIED, Step.STAGED, Step.STORED])
def test_a_payload_under_way_is_being_worked_on(step: Step) -> None:
    assert states(known(at(step))) == [State.WORKING]


def test_a_refused_payload_tells_its_code_and_why(golden: Golden) -> None:
    [refused] = state_reasons(known(at(Step.REFUSED, UNSIGNED)))
    assert refused == StateReason(
        State.REFUSED, "payload k", refused.sentence, "SIG_MISSING", "org.example.eye"
    )
    golden.check("a payload is refused", refused.sentence)


def test_a_payload_that_runs_on_a_peer_is_not_refused_here() -> None:
    here = known(at(Step.REFUSED, UNSIGNED))
    assert states(replace(here, places=("k",))) == []


def test_a_drive_without_a_payload_is_refused() -> None:
    empty = replace(DRIVE, problems=(Problem("DRIVE_NOT_PAYLOAD", "carries no payload"),))
    [refused] = state_reasons(known(drive=empty))
    assert (refused.state, refused.code) == (State.REFUSED, "DRIVE_NOT_PAYLOAD")


def test_a_payload_that_could_not_be_brought_to_life_needs_help() -> None:
    assert states(known(at(Step.QUARANTINED, UNSIGNED))) == [State.HELP]


def test_a_goal_that_cannot_be_had_needs_help(golden: Golden) -> None:
    missing = Problem("NO_PLAN", "nothing can see\nand more")
    goal = GivenGoal("3", "follow me", "(x)", "maintain", 0, 3, GoalState.SUSPENDED, "", (missing,))
    [help] = state_reasons(Known(Snapshot("spot", 1), goals=(goal,)))
    assert (help.state, help.code) == (State.HELP, "NO_PLAN")
    golden.check("a goal is suspended", help.sentence)


def test_a_drive_that_may_be_pulled_tells_what_ends_then(golden: Golden) -> None:
    eye = component("eye", "k")
    golden.check("a drive may be pulled", told(eye, PAYLOAD))
    two = replace(PAYLOAD, sources={**PAYLOAD.sources, "sdc1-8": Path("/mnt")})
    golden.check("one of two drives may be pulled", told(eye, two))


def told(eye: ComponentRecord, payload: PayloadRecord) -> str:
    here = known(payload)
    [safe] = state_reasons(replace(here, snapshot=replace(here.snapshot, components=(eye,))))
    return safe.sentence


def test_a_component_that_waits_for_its_device_needs_help(golden: Golden) -> None:
    waiting = component("eye", "k", need="0403")
    [help] = state_reasons(Known(Snapshot("spot", 1, components=(waiting,))))
    assert (help.state, help.code) == (State.HELP, "DEVICE_MISSING")
    golden.check("a device is missing", help.sentence)
    served = replace(waiting, devices=(replace(waiting.devices[0], device="usb:1-4"),))
    assert not state_reasons(Known(Snapshot("spot", 1, components=(served,))))


def test_safe_mode_needs_help() -> None:
    [help] = state_reasons(Known(Snapshot("spot", 1, safety=Safety.INITIAL)))
    assert (help.state, help.code) == (State.HELP, "SAFE_MODE")


def test_initial_components_are_no_drives_that_anybody_pulls() -> None:
    installed = replace(DRIVE, kind="installed", state=DriveState.READING)
    assert states(known(PAYLOAD, drive=installed)) == []

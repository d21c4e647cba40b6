"""What daemons die of is counted, and after five deaths left alone until a person acts."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from tests.host.lifecycle.states import AT, active, after, at_step, drive, found, way_to_active

from nondum.host.core import effects
from nondum.host.core.events.daemon import HostStable
from nondum.host.core.events.drives import DriveInserted, DriveRead, DriveRemoved, DrivesScanned
from nondum.host.core.events.event import Event
from nondum.host.core.events.payloads import PayloadCleared, RetryAsked
from nondum.host.core.records.drive import DriveState
from nondum.host.core.records.moment import Moment
from nondum.host.core.records.step import Step
from nondum.host.core.state import HostState
from nondum.host.lifecycle.advance import advance
from nondum.host.lifecycle.crash_attribution import ATTEMPTS, STEADY_S
from nondum.host.lifecycle.recovery import recover

BEGUN = (Step.RECEIVED, Step.COPIED, Step.VERIFIED, Step.STAGED, Step.STORED, Step.PROBED)
DRIVE = "slot:a"
LATER = Moment(AT.monotonic_s + STEADY_S, AT.wall_s)


def died(state: HostState, times: int = 1) -> HostState:
    """Daemons that start on it, and die at once."""
    for _ in range(times):
        state = recover(state, AT).state
    return state


def stopped(state: HostState) -> HostState:
    return replace(state, is_stopped=True)


def on(state: HostState, *happened: Event) -> HostState:
    return after(*happened, state=state)[0]


@pytest.mark.parametrize("step", BEGUN)
def test_payload_that_was_begun_is_counted(step: Step) -> None:
    read = on(at_step(step), DriveRead("a", ("k1",)))
    assert died(read).tries == {"k1": 1}
    assert died(stopped(read)).tries == {}


@pytest.mark.parametrize("step", [Step.REFUSED, Step.QUARANTINED, Step.REMOVING])
def test_payload_that_waits_is_not_counted(step: Step) -> None:
    assert died(on(at_step(step), DriveRead("a", ("k1",)))).tries == {}


def test_drive_that_was_being_read_is_counted() -> None:
    assert died(on(HostState("spot"), drive())).tries == {DRIVE: 1}


def test_guests_that_ran_are_to_blame_only_where_nothing_was_begun() -> None:
    assert died(active()).tries == {"k1": 1}
    assert died(on(active(), drive("b"))).tries == {"slot:b": 1}


def test_what_is_installed_for_good_is_never_to_blame_while_it_runs() -> None:
    installed = on(HostState("spot"), drive("a", "installed"), *way_to_active())
    assert died(on(installed, DriveRead("a", ("k1",)))).tries == {}


def test_drive_is_left_alone_until_it_is_plugged_in_again() -> None:
    state = HostState("spot")
    for _ in range(ATTEMPTS):
        state = died(on(state, drive()))
    again, done = after(drive(), state=state)
    assert [type(effect) for effect in done] == [effects.ReleaseDrive]
    assert again.drives["a"].state is DriveState.IDLE
    assert [problem.code for problem in again.drives["a"].problems] == ["QUARANTINED"]
    assert died(stopped(again)).tries == {DRIVE: ATTEMPTS}
    pulled, done = after(DriveRemoved("a"), drive(), state=again)
    assert any(isinstance(effect, effects.ReadDrive) for effect in done)
    assert not pulled.tries


def test_drive_that_was_pulled_while_no_daemon_ran_is_forgotten_after_a_while() -> None:
    """It may only be found late."""
    state = died(on(HostState("spot"), drive()))
    scanned = on(state, DrivesScanned("slot", ()))
    assert scanned.tries == {DRIVE: 1}
    assert died(on(scanned, drive())).tries == {DRIVE: 2}
    assert not on(scanned, HostStable("spot")).tries


def numbered(number: int, mark: str = "Acme-0042") -> DriveInserted:
    """A drive as the kernel numbers it; what it says of itself stays."""
    return DriveInserted(f"sda-{number}", Path("/mounts"), "block", mark=mark)


def test_drive_is_left_alone_after_the_machine_has_started_again() -> None:
    state = HostState("spot")
    for number in range(ATTEMPTS):
        state = died(on(state, numbered(number), DrivesScanned("block", (f"sda-{number}",))))
    assert on(state, numbered(9)).drives["sda-9"].problems[0].code == "QUARANTINED"
    assert not on(state, numbered(9, "Acme-0043")).drives["sda-9"].problems


def test_drive_that_carried_what_ran_is_counted_on_under_its_new_number() -> None:
    """What is remembered of the last start is taken for pulled, the same stick for plugged in."""
    first = on(HostState("spot"), numbered(1), found(drive="sda-1"), *way_to_active()[2:])
    reading = on(first, numbered(1))
    assert reading.drives["sda-1"].state is DriveState.READING
    state = on(died(reading), numbered(2), DrivesScanned("block", ("sda-2",)))
    assert set(state.drives) == {"sda-2"}
    assert state.tries["block:Acme-0042"] == 1


@pytest.mark.parametrize("is_found_late", [False, True])
def test_payload_is_left_alone_after_the_machine_has_started_again(is_found_late: bool) -> None:
    state = HostState("spot")
    for _ in range(ATTEMPTS):
        state = died(on(state, numbered(1), found(drive="sda-1"), DriveRead("sda-1", ("k1",))))
    state = on(state, numbered(1), found(drive="sda-1"), DriveRead("sda-1", ("k1",)))
    state = on(state, HostStable("spot"))
    assert state.payloads["k1"].step is Step.REFUSED
    scanned = DrivesScanned("block", () if is_found_late else ("sda-2",))
    news = (scanned, numbered(2)) if is_found_late else (numbered(2), scanned)
    cleared = PayloadCleared("k1")
    state = on(died(state), *news, cleared, found(drive="sda-2"))
    assert set(state.drives) == {"sda-2"}
    assert state.payloads["k1"].step is Step.REFUSED
    pulled = on(state, DriveRemoved("sda-2"), cleared)
    assert not pulled.tries
    again = on(pulled, numbered(3), found(drive="sda-3"))
    assert again.payloads["k1"].step is Step.RECEIVED


def test_drive_under_its_new_number_is_pulled_like_any() -> None:
    state = on(died(on(HostState("spot"), numbered(1))), numbered(2))
    assert not on(state, DriveRemoved("sda-2")).tries.keys() & {"block:Acme-0042"}


def test_payload_is_refused_after_too_many_deaths_and_retried_when_asked() -> None:
    state = HostState("spot")
    read = DriveRead("a", ("k1",))
    for _ in range(ATTEMPTS):
        state = died(on(state, drive(), found(), read))
    state, done = after(drive(), found(), read, state=state)
    assert state.payloads["k1"].step is Step.REFUSED
    assert [problem.code for problem in state.payloads["k1"].problems] == ["QUARANTINED"]
    assert not any(isinstance(effect, effects.CopyPayload) for effect in done)
    cleared = PayloadCleared("k1")
    state, done = after(RetryAsked("k1"), cleared, found(), state=state)
    assert state.payloads["k1"].step is Step.RECEIVED
    assert any(isinstance(effect, effects.CopyPayload) for effect in done)


def test_daemon_that_lives_on_clears_what_is_active_for_long_enough() -> None:
    state = died(active())
    back = on(state, drive(), DriveRead("a", ("k1",)), *way_to_active()[5:])
    assert on(back, HostStable("spot")).tries == {"k1": 1}
    assert not advance(back, HostStable("spot"), LATER).state.tries


@pytest.mark.parametrize(("step", "is_kept"), [(Step.STORED, True), (Step.REFUSED, False)])
def test_what_is_still_begun_stays_counted(step: Step, is_kept: bool) -> None:
    state = replace(on(at_step(step), DriveRead("a", ("k1",))), tries={"k1": 1})
    assert on(state, HostStable("spot")).tries == ({"k1": 1} if is_kept else {})


def test_nothing_is_cleared_while_a_drive_is_being_read() -> None:
    state = replace(on(HostState("spot"), drive()), tries={"k9": 3})
    assert on(state, HostStable("spot")).tries == {"k9": 3}
    read = on(state, DriveRead("a", ()))
    assert not on(read, HostStable("spot")).tries

"""The component manager's function, without clock, disk or processes."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.host.lifecycle.states import (
    AT,
    PROBLEM,
    active,
    after,
    at_step,
    drive,
    found,
    way_to_active,
    with_newer,
)
from tests.host.sources.devices.sightings import appeared

from nondum.host.core import effects
from nondum.host.core.events.devices import DeviceRemoved
from nondum.host.core.events.drives import DriveRead, DriveRemoved, DrivesScanned, DriveUnreadable
from nondum.host.core.events.event import Event
from nondum.host.core.events.inputs import InputConnected
from nondum.host.core.events.mounts import MountSet
from nondum.host.core.events.payloads import (
    PayloadCleared,
    PayloadCopied,
    PayloadFailed,
    PayloadFound,
    PayloadRefused,
    PayloadWithdrawn,
    RetryAsked,
)
from nondum.host.core.events.placement import PayloadSentAway
from nondum.host.core.events.releases import PayloadResumed, PayloadSuperseded, RollbackAsked
from nondum.host.core.events.trust import PayloadDistrusted
from nondum.host.core.events.workers import (
    ConditionEnded,
    WorkerExited,
    WorkerFailed,
    WorkerReady,
    WorkerStable,
)
from nondum.host.core.records.component import ComponentState
from nondum.host.core.records.drive import DriveState
from nondum.host.core.records.step import Step
from nondum.host.core.state import HostState
from nondum.host.core.transitions import COMPONENT_TRANSITIONS, HELD, RECOVERY, TRANSITIONS
from nondum.host.lifecycle.advance import advance
from nondum.host.lifecycle.crash_attribution import ATTEMPTS
from nondum.host.lifecycle.recovery import recover
from nondum.sdk.description import PluginDescription
from nondum.sdk.errors import Problem

EVENTS: dict[type[Event], Event] = {
    type(event): event
    for event in (
        *way_to_active(),
        PayloadRefused("k1", (PROBLEM,)),
        PayloadFailed("k1", (PROBLEM,)),
        PayloadSentAway("k1", "mule", (PROBLEM,)),
        PayloadDistrusted("k1", (PROBLEM,)),
        PayloadWithdrawn("k1", "test"),
        PayloadCleared("k1"),
        PayloadSuperseded("k1", "k2", "test"),
        PayloadResumed("k1", "test"),
        RollbackAsked("k1", 1, 2),
        RetryAsked("k1"),
    )
}


@pytest.mark.parametrize(
    ("step", "kind"), TRANSITIONS, ids=lambda value: getattr(value, "__name__", str(value))
)
def test_each_row_leads_where_it_says(step: Step, kind: type[Event]) -> None:
    row = TRANSITIONS[step, kind]
    state = with_newer(at_step(step)) if kind is PayloadSuperseded else at_step(step)
    outcome = advance(state, EVENTS[kind], AT)
    payload = outcome.state.payloads.get("k1")
    assert (payload.step if payload else Step.GONE) is row.to
    assert row.effect is None or row.effect in map(type, outcome.effects)
    assert EVENTS[kind] in outcome.events


@pytest.mark.parametrize("step", Step)
@pytest.mark.parametrize("kind", EVENTS, ids=lambda kind: kind.__name__)
def test_news_of_an_earlier_life_is_dropped(step: Step, kind: type[Event]) -> None:
    asked = (RetryAsked, RollbackAsked)
    if (step, kind) in TRANSITIONS or kind in (PayloadFound, *asked):
        return
    state = at_step(step)
    outcome = advance(state, EVENTS[kind], AT)
    assert (outcome.state, outcome.effects, outcome.events) == (state, (), ())


def test_recovery_knows_every_step() -> None:
    assert set(RECOVERY) == set(Step) - {Step.GONE}


def test_every_component_state_can_be_left() -> None:
    assert {state for state, _ in COMPONENT_TRANSITIONS} == set(ComponentState)


def test_insertion_reads_the_drive() -> None:
    state, done = after(drive())
    assert done == [effects.ReadDrive("a", "slot", Path("/drives/a"))]
    assert state.drives["a"].state is DriveState.READING


def test_activation_enters_components_in_one_turn() -> None:
    state = active()
    assert list(state.components) == ["eye"]
    assert state.revision == 1
    assert state.highwater["org.x"].release == 1
    assert "spot__eye__camera" in state.mounts
    assert set(state.payloads["k1"].phases) == {"seen", "verified", "installed", "ready"}


def test_pulled_drive_withdraws_at_once() -> None:
    state, done = after(DriveRemoved("a"), state=active())
    assert not state.components
    assert not state.mounts
    assert state.revision == 2
    assert state.payloads["k1"].step is Step.REMOVING
    assert done == [effects.ReleaseDrive("a"), effects.CachePayload("k1", ("eye",))]


def test_second_source_keeps_the_payload() -> None:
    both, _ = after(drive("b"), found(drive="b"), state=active())
    state, done = after(DriveRemoved("a"), state=both)
    assert "eye" in state.components
    assert done == [effects.ReleaseDrive("a")]


def test_copy_goes_on_from_the_other_drive() -> None:
    state, _ = after(drive("a"), drive("b"), found(), found(drive="b"))
    _, done = after(DriveRemoved("a"), state=state)
    assert [e.drive for e in done if isinstance(e, effects.CopyPayload)] == ["b"]


def test_replug_while_removing_reads_the_drive_again() -> None:
    removing, _ = after(DriveRemoved("a"), drive("a"), found(), state=active())
    state, done = after(PayloadCleared("k1"), state=removing)
    assert not state.payloads
    assert done == [effects.ReadDrive("a", "slot", Path("/drives/a"))]


def test_older_release_is_refused() -> None:
    gone, _ = after(DriveRemoved("a"), PayloadCleared("k1"), state=active())
    state, done = after(drive(), found("k0", release=0), state=gone)
    assert [p.code for p in state.payloads["k0"].problems] == ["ROLLBACK"]
    assert not any(isinstance(effect, effects.CopyPayload) for effect in done)


def test_same_release_with_other_content_is_refused() -> None:
    gone, _ = after(DriveRemoved("a"), PayloadCleared("k1"), state=active())
    state, _ = after(drive(), found("k2"), state=gone)
    assert [p.code for p in state.payloads["k2"].problems] == ["RELEASE_CONFLICT"]


def test_implausible_release_is_refused() -> None:
    gone, _ = after(DriveRemoved("a"), PayloadCleared("k1"), state=active())
    state, _ = after(drive(), found("k2", release=2**53), state=gone)
    assert [p.code for p in state.payloads["k2"].problems] == ["RELEASE_JUMP"]


def test_drive_is_released_when_all_is_copied() -> None:
    reading, before = after(drive(), found(), DriveRead("a", ("k1",)))
    assert effects.ReleaseDrive("a") not in before
    state, done = after(PayloadCopied("k1"), state=reading)
    assert effects.ReleaseDrive("a") in done
    assert state.drives["a"].state is DriveState.IDLE


def test_drive_without_payload_says_so() -> None:
    state, done = after(drive(), DriveRead("a", ()))
    assert [p.code for p in state.drives["a"].problems] == ["DRIVE_NOT_PAYLOAD"]
    assert effects.ReleaseDrive("a") in done


def test_unreadable_drive_gives_up_what_was_being_copied() -> None:
    state, done = after(drive(), found(), DriveUnreadable("a", (PROBLEM,)))
    assert state.drives["a"].problems == (PROBLEM,)
    assert state.payloads["k1"].step is Step.REMOVING
    assert effects.CachePayload("k1") in done


def test_worker_that_restarts_is_not_ready_meanwhile() -> None:
    state, _ = after(WorkerExited("eye", "signal 9"), state=active())
    assert state.components["eye"].state is ComponentState.RESTARTING
    assert state.revision == 2
    again = WorkerReady("eye", PluginDescription("eye", "1.0"))
    assert after(again, state=state)[0].components["eye"].state is ComponentState.READY


def test_why_a_worker_ended_stays_with_its_component_until_the_next_one_has_lasted() -> None:
    ended = WorkerExited("eye", "it hung", problem=PROBLEM)
    again = WorkerReady("eye", PluginDescription("eye", "1.0"))
    state, _ = after(ended, again, state=active())
    assert state.components["eye"].state is ComponentState.READY
    assert state.components["eye"].problems == (PROBLEM,)
    state, _ = after(WorkerStable("eye"), state=state)
    assert state.components["eye"].problems == ()


def test_condition_that_has_ended_is_a_problem_of_its_component_while_its_worker_lives() -> None:
    dead = Problem("CONDITION_RAISED", "ValueError: x", where="sees of eye (eye.py:3)")
    told = ConditionEnded("eye", "sees", (dead,), "k1")
    state, _ = after(told, state=active())
    assert state.components["eye"].problems == (dead,)
    assert state.components["eye"].is_ready
    assert after(told, state=state) == (state, [])
    assert after(WorkerStable("eye"), state=state) == (state, [])
    state, _ = after(WorkerExited("eye", "signal 9"), state=state)
    assert state.components["eye"].problems == ()


def test_condition_of_another_release_is_no_news() -> None:
    told = ConditionEnded("eye", "sees", (PROBLEM,), "k2")
    assert after(told, state=active())[0] == active()


def test_failed_worker_is_quarantined_until_told() -> None:
    state, _ = after(WorkerFailed("eye", (PROBLEM,)), state=active())
    assert state.components["eye"].problems == (PROBLEM,)
    told, done = after(RetryAsked("k1"), state=state)
    assert done == [effects.RestartWorker("eye")]
    assert told.components["eye"].state is ComponentState.RESTARTING


def test_worker_that_fails_before_activation_takes_its_payload_along() -> None:
    state, _ = after(WorkerFailed("eye", (PROBLEM,)), state=at_step(Step.PROBED))
    assert state.payloads["k1"].step is Step.QUARANTINED
    assert state.payloads["k1"].problems == (PROBLEM,)


def test_device_goes_to_who_needs_it() -> None:
    port = appeared("usb1", "/dev/ttyUSB0", ID_MODEL="PTU")
    other = appeared("usb2", "/dev/ttyUSB1", ID_MODEL="other")
    before = active(need="PT*")
    assert not before.components["eye"].is_ready
    state, done = after(other, port, state=before)
    assert done == [effects.AttachDevice("eye", "port", state.devices["usb1"].nodes)]
    assert state.components["eye"].is_ready
    state, done = after(DeviceRemoved("usb1"), state=state)
    assert done == [effects.DetachDevice("eye", "port", "usb1")]
    assert not state.components["eye"].is_ready


def test_contested_device_stays_and_the_contest_is_told() -> None:
    port = appeared("usb1", "/dev/ttyUSB0", ID_MODEL="PTU")
    held, _ = after(port, state=active(id="zoom", need="PTU"))
    rival = way_to_active("k2", "b", "arm", "PTU", payload_id="org.y")
    state, _ = after(drive("b"), *rival, state=held)
    assert state.components["zoom"].devices[0].device == "usb1"
    assert state.components["zoom"].devices[0].contested_by == ("arm",)
    assert state.components["arm"].devices[0].device is None


def test_persons_mount_outlives_the_component() -> None:
    unit = "spot__eye__camera"
    said = MountSet(unit, (1.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    state, _ = after(said, DriveRemoved("a"), state=active())
    assert state.mounts[unit].origin == "person"


def test_what_a_person_connected_outlives_the_component() -> None:
    name = "eye.camera.odometry"
    said = InputConnected(name, "spot__base__odometry")
    state, _ = after(said, DriveRemoved("a"), state=active())
    assert state.connections == {name: "spot__base__odometry"}
    state, _ = after(InputConnected(name, ""), state=state)
    assert state.connections == {}


def test_connecting_an_input_is_a_recomposition() -> None:
    before = active()
    state, _ = after(InputConnected("eye.camera.odometry", "s"), state=before)
    assert state.revision == before.revision + 1
    assert state.snapshot().connections == (("eye.camera.odometry", "s"),)


def test_initial_components_come_first() -> None:
    state = active()
    installed = way_to_active("k2", "i", "base", payload_id="org.y")
    state, _ = after(drive("i", "installed"), *installed, state=state)
    assert [c.id for c in state.snapshot().components] == ["base", "eye"]


@pytest.mark.parametrize("step", RECOVERY)
def test_recovery_sends_back_or_forward(step: Step) -> None:
    outcome = recover(at_step(step), AT)
    payload = outcome.state.payloads.get("k1")
    assert (payload.step if payload else Step.GONE) is RECOVERY[step].to
    assert not outcome.state.components


def test_drive_that_left_while_the_daemon_was_down_is_withdrawn() -> None:
    recovered = recover(active(), AT).state
    state, done = after(DrivesScanned("slot", ()), state=recovered)
    assert state.payloads["k1"].step is Step.REMOVING
    assert effects.CachePayload("k1", ("eye",)) in done


def test_payload_swapped_while_the_daemon_was_down_is_withdrawn() -> None:
    recovered = recover(active(), AT).state
    state, _ = after(drive(), DriveRead("a", ()), state=recovered)
    assert state.payloads["k1"].step is Step.REMOVING


def test_payload_that_ends_the_daemon_is_quarantined() -> None:
    state = active()
    for _ in range(ATTEMPTS - 1):
        state = recover(state, AT).state
        assert state.payloads["k1"].step is Step.STORED
    outcome = recover(state, AT)
    assert outcome.state.payloads["k1"].step is Step.QUARANTINED
    assert outcome.effects == (effects.SuspendPayload("k1", ("eye",)),)


HAPPENINGS: list[Event] = [
    *(drive(name) for name in ("a", "b")),
    *(DriveRemoved(name) for name in ("a", "b")),
    *(DriveRead(name, keys) for name in ("a", "b") for keys in ((), ("k1",), ("k2",))),
    DriveUnreadable("a", (PROBLEM,)),
    DrivesScanned("slot", ("a",)),
    *way_to_active("k1", "a"),
    *way_to_active("k2", "b", "arm", "PTU", payload_id="org.y"),
    *way_to_active("k3", "b", "eye"),
    *(kind(key, (PROBLEM,)) for kind in (PayloadRefused, PayloadFailed) for key in ("k1", "k2")),
    *(PayloadCleared(key) for key in ("k1", "k2", "k3")),
    *(RetryAsked(key) for key in ("k1", "k2", "k3")),
    WorkerExited("eye", "test"),
    WorkerExited("eye", "test", problem=PROBLEM),
    WorkerStable("eye"),
    ConditionEnded("eye", "sees", (PROBLEM,)),
    WorkerFailed("arm", (PROBLEM,)),
    WorkerReady("eye", PluginDescription("eye", "1.0")),
    appeared("usb1", "/dev/x", ID_MODEL="PTU"),
    DeviceRemoved("usb1"),
]


@given(st.lists(st.sampled_from(HAPPENINGS), max_size=60), st.integers(0, 60))
def test_whatever_happens_the_state_is_sound(happened: list[Event], restart: int) -> None:
    state = HostState("spot")
    for i, event in enumerate(happened):
        outcome = recover(state, AT) if i == restart else advance(state, event, AT)
        assert sound(outcome.state)
        assert outcome.state == state or outcome.events
        state = outcome.state


def sound(state: HostState) -> bool:
    for payload in state.payloads.values():
        assert payload.step is not Step.GONE
        assert set(payload.sources) <= set(state.drives)
        assert payload.sources or payload.step is Step.REMOVING
    for owned in state.components.values():
        assert state.payloads[owned.payload].step is Step.ACTIVE
        for claim in owned.devices:
            assert claim.device is None or claim.device in state.devices
    ids = [id for p in state.payloads.values() if p.step is Step.ACTIVE for id in p.components]
    assert sorted(ids) == sorted(state.components)
    return True


@pytest.mark.parametrize(("step", "event"), [row for row in TRANSITIONS if row[1] in HELD])
def test_progress_that_is_held_is_what_recovery_does_not_tell_apart(
    step: Step, event: type[Event]
) -> None:
    assert RECOVERY[TRANSITIONS[step, event].to] == RECOVERY[step]

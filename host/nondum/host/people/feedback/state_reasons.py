"""What a host knows → the reasons for the state that it shows to people. Pure."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator

from nondum.host.core.feedback_state import State, StateReason
from nondum.host.core.records.component import ComponentState
from nondum.host.core.records.drive import INSTALLED, DriveRecord, DriveState
from nondum.host.core.records.payload import PayloadRecord
from nondum.host.core.records.safety import Safety
from nondum.host.core.records.snapshot import Snapshot
from nondum.host.core.records.step import Step
from nondum.host.core.status import is_at_rest, waits
from nondum.host.mind.goals import GivenGoal, GoalState
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen

PLUGGED = frozenset({"slot", "block"})
"""Kinds of drives that people plug in and pull."""
_WELL = frozenset({Step.ACTIVE, Step.SUPERSEDED})


@frozen
class Known:
    """All that the state is made of."""

    snapshot: Snapshot
    unmounted: Collection[str] = ()
    """Drives that are known to be let go of: nothing is mounted, nothing reads."""
    places: Collection[str] = ()
    """Keys of payloads that run on peers."""
    goals: tuple[GivenGoal, ...] = ()
    more: tuple[StateReason, ...] = ()
    """State reasons that other parts of the host work out."""


def state_reasons(known: Known) -> tuple[StateReason, ...]:
    """All reasons for a state other than READY."""
    found = (
        *(c for payload in known.snapshot.payloads for c in _of_payload(payload, known)),
        *(c for drive in known.snapshot.drives for c in _of_drive(drive, known)),
        *_of_components(known.snapshot),
        *(_of_goal(goal) for goal in known.goals if _cannot_be_had(goal)),
        *_of_host(known.snapshot),
        *known.more,
    )
    return tuple(found)


def _of_payload(payload: PayloadRecord, known: Known) -> Iterator[StateReason]:
    about, name = f"payload {payload.key}", payload.payload_id
    if payload.key in known.places:
        return
    if payload.step is Step.REFUSED:
        yield refusal(State.REFUSED, about, f"{name} is refused", payload.problems, payload=name)
    elif payload.step is Step.QUARANTINED:
        told = f"{name} does not work"
        yield refusal(State.HELP, about, told, payload.problems, payload=name)
    elif not is_at_rest(payload):
        doing = "is being removed" if payload.step is Step.REMOVING else "is being installed"
        yield StateReason(State.WORKING, about, f"{name} {doing}", payload=name)


def _of_drive(drive: DriveRecord, known: Known) -> Iterator[StateReason]:
    about = f"drive {drive.id}"
    if drive.kind == INSTALLED:
        return
    if drive.problems:
        told = f"drive {drive.id} cannot be used"
        yield refusal(State.REFUSED, about, told, drive.problems, drive=drive.id)
    elif drive.state is not DriveState.IDLE:
        yield StateReason(State.WORKING, about, f"drive {drive.id} is being read", drive=drive.id)
    elif drive.kind in PLUGGED and is_safe(drive, known):
        yield StateReason(State.SAFE, about, may_be_pulled(drive, known.snapshot), drive=drive.id)


def ending_with(drive: DriveRecord, snapshot: Snapshot) -> list[str]:
    """The components that end when a drive is pulled: those that came with no other one."""
    ending = {payload.key for payload in snapshot.payloads if set(payload.sources) == {drive.id}}
    return [component.id for component in snapshot.components if component.payload in ending]


def may_be_pulled(drive: DriveRecord, snapshot: Snapshot) -> str:
    """That nothing is lost by it, and what ends."""
    names = ending_with(drive, snapshot)
    then = f"; {' and '.join(names)} then end{'s' if len(names) == 1 else ''}" if names else ""
    return f"drive {drive.id} may be pulled{then}"


def is_safe(drive: DriveRecord, known: Known) -> bool:
    """Whether a person can pull a drive now without loss: all payloads that it brought are active,
    and it is unmounted."""
    brought = [p for p in known.snapshot.payloads if drive.id in p.sources]
    return drive.id in known.unmounted and all(payload.step in _WELL for payload in brought)


def _of_host(snapshot: Snapshot) -> Iterator[StateReason]:
    if snapshot.safety is not Safety.OFF:
        told = "the host is in safe mode, and leaves payloads alone"
        yield StateReason(State.HELP, "host", told, "SAFE_MODE")


def _of_components(snapshot: Snapshot) -> Iterator[StateReason]:
    for component in snapshot.components:
        if component.state is ComponentState.QUARANTINED:
            about, told = f"component {component.id}", f"{component.id} does not work"
            payload = component.payload_id
            yield refusal(State.HELP, about, told, component.problems, payload=payload)
        for problem in waits(component):
            yield StateReason(
                State.HELP, f"component {component.id}", problem.message, problem.code
            )


def _cannot_be_had(goal: GivenGoal) -> bool:
    return goal.state is GoalState.SUSPENDED


def _of_goal(goal: GivenGoal) -> StateReason:
    told = f"goal {goal.id} cannot be had now, {goal.text}"
    if goal.problems:
        return refusal(State.HELP, f"goal {goal.id}", told, goal.problems)
    return StateReason(State.HELP, f"goal {goal.id}", f"{told}: {goal.reason}")


def refusal(
    state: State,
    about: str,
    told: str,
    problems: Iterable[Problem],
    *,
    payload: str = "",
    drive: str = "",
) -> StateReason:
    """A state reason with the code and the message of the first problem."""
    first = next(iter(problems), None)
    if first is None:
        return StateReason(state, about, told, payload=payload, drive=drive)
    line = first.message.splitlines()[0]
    return StateReason(state, about, f"{told}: {line}", first.code, payload, drive)

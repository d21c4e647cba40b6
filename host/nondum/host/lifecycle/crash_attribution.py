"""Crash attribution: counts what daemons were at when they died, and leaves it alone in the end.

A daemon commits what it is going to do before it does it, so a daemon that starts finds what the
last one was at. One that ended because it was told to counts for nothing.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Set

from nondum.host.core.events.daemon import HostStable
from nondum.host.core.events.drives import DriveRead, DriveRemoved, DriveRetried, DriveUnreadable
from nondum.host.core.events.event import Event
from nondum.host.core.events.payloads import PayloadFound, RetryAsked
from nondum.host.core.records.drive import INSTALLED, DriveRecord, DriveState
from nondum.host.core.records.payload import PayloadRecord
from nondum.host.core.records.safety import Safety
from nondum.host.core.records.snapshot import Snapshot
from nondum.host.core.records.step import Step
from nondum.host.core.state import HostState
from nondum.host.lifecycle.turn import Turn
from nondum.sdk.errors import Problem

ATTEMPTS = 5
"""Daemons in a row that may die at the same drive or payload; the next one leaves it alone."""

ON_TRIAL = 1000
"""The count of what was left alone and is on its one trial. The next death leaves it alone until a
person asks."""

STEADY_S = 5.0
"""A daemon that lives so long beside what it brought to life does not die of it."""

_BEGUN = frozenset(
    {Step.RECEIVED, Step.COPIED, Step.VERIFIED, Step.STAGED, Step.STORED, Step.PROBED}
)


def subject_of(drive: DriveRecord) -> str:
    """What a drive is counted by; a payload is by its key.

    The kernel numbers drives again when the machine starts, so what they say of themselves counts,
    where they do. A drive that says another thing each time is counted until the next start.
    """
    return f"{drive.kind}:{drive.mark or drive.id}"


def counted(state: HostState) -> Mapping[str, int]:
    """The tries once the daemon that left this state is known to be dead."""
    if state.is_stopped:
        return state.tries
    return {**state.tries, **{s: state.tries.get(s, 0) + 1 for s in _suspects(state)}}


def is_left_alone(state: HostState, subject: str) -> bool:
    """Whether too many daemons died at it."""
    return _are_too_many(state.tries.get(subject, 0))


def _are_too_many(deaths: int) -> bool:
    return deaths >= ATTEMPTS and deaths != ON_TRIAL


def counts(snapshot: Snapshot) -> Iterator[str]:
    """What is told of drives and payloads that daemons died at and that are not left alone yet."""
    drives = {subject_of(drive): f"drive {drive.id}" for drive in snapshot.drives}
    names = {**{p.key: p.payload_id for p in snapshot.payloads}, **drives}
    for subject, deaths in snapshot.tries.items():
        if subject not in names or _are_too_many(deaths):
            continue
        if deaths == ON_TRIAL:
            yield f"{names[subject]} is tried again; if the daemon dies once more, it is left alone"
        else:
            died = "1 daemon" if deaths == 1 else f"{deaths} daemons in a row"
            yield f"{died} died at {names[subject]}; after {ATTEMPTS} it is left alone"


def left_alone(state: HostState, subject: str, where: str) -> Problem:
    """What is told of what too many daemons died at."""
    fix = (
        "pull it and plug it in again, or ask for another try with `nondum retry` or "
        "`nondum host resume --all`"
    )
    if state.tries[subject] < ON_TRIAL:
        fix += "; a daemon that has lived for an hour tries it once by itself"
    return Problem(
        "QUARANTINED",
        f"{ATTEMPTS} daemons in a row ended while they were at it, so it is left alone",
        where=where,
        fix=fix,
    )


def drive_problems(state: HostState, drive: DriveRecord) -> tuple[Problem, ...]:
    """What there is against looking at a drive."""
    subject = subject_of(drive)
    return (left_alone(state, subject, drive.id),) if is_left_alone(state, subject) else ()


def payload_problems(state: HostState, found: PayloadFound) -> tuple[Problem, ...]:
    """What there is against taking in a payload."""
    subject = found.payload
    return (left_alone(state, subject, found.payload_id),) if is_left_alone(state, subject) else ()


def on_event(turn: Turn, event: Event) -> None:
    """Clear what was survived, was pulled, or is to be tried again."""
    match event:
        case DriveRead() | DriveUnreadable():
            drive = turn.state.drives.get(event.drive)
            if drive is None or turn.state.safety is not Safety.OFF:
                return
            if not is_left_alone(turn.state, subject_of(drive)):
                _clear(turn, subject_of(drive))
        case DriveRemoved():
            drive = turn.state.drives.get(event.drive)
            if drive is not None and drive.id not in turn.missed:
                _clear(turn, *_pulled_with(turn.state, drive))
        case RetryAsked(why=""):
            _clear(turn, event.payload)
        case DriveRetried(why="") if event.drive in turn.state.drives:
            _clear(turn, subject_of(turn.state.drives[event.drive]))


def _pulled_with(state: HostState, drive: DriveRecord) -> Set[str]:
    """What is not there any more once a drive has been pulled."""
    payloads = {p.key for p in state.payloads.values() if p.sources.keys() == {drive.id}}
    others = {subject_of(other) for other in state.drives.values() if other is not drive}
    return payloads | ({subject_of(drive)} - others)


def _clear(turn: Turn, *subjects: str) -> None:
    if any(subject in turn.state.tries for subject in subjects):
        kept = {s: deaths for s, deaths in turn.state.tries.items() if s not in subjects}
        turn.change(tries=kept)


def on_host_stable(turn: Turn, event: HostStable) -> None:
    """Clear what has been lived with for a while, and what did not come again.

    What is left alone stays so for as long as it is there. A machine that has just been started may
    find its drives a moment later, and by other names: it is not until now that they were pulled.
    """
    state = turn.state
    if state.safety is not Safety.OFF:
        return  # nothing was lived with
    if any(drive.state is DriveState.READING for drive in state.drives.values()):
        return
    drives = {subject_of(drive) for drive in state.drives.values()}
    kept = {
        subject: deaths
        for subject, deaths in state.tries.items()
        if subject in drives
        or _is_on_trial(turn, state.payloads.get(subject))
        or (subject in state.payloads and is_left_alone(state, subject))
    }
    if kept != state.tries:
        turn.events.append(event)
        turn.change(tries=kept)


def _is_on_trial(turn: Turn, payload: PayloadRecord | None) -> bool:
    if payload is None:
        return False
    if payload.step is not Step.ACTIVE:
        return payload.step in _BEGUN
    return turn.at.monotonic_s - payload.phases["ready"].monotonic_s < STEADY_S


def _suspects(state: HostState) -> frozenset[str]:
    """What was begun and not ended; if nothing was, the guests that were running.

    What is installed for good is no guest: a host without it is of no use.
    """
    reading = {subject_of(d) for d in state.drives.values() if d.state is DriveState.READING}
    begun = {p.key for p in state.payloads.values() if p.step in _BEGUN}
    if reading or begun:
        return frozenset(reading | begun)
    return frozenset(
        p.key for p in state.payloads.values() if p.step is Step.ACTIVE and not is_initial(state, p)
    )


def is_initial(state: HostState, payload: PayloadRecord) -> bool:
    """Whether a payload was installed for good."""
    kinds = {state.drives[drive].kind for drive in payload.sources if drive in state.drives}
    return INSTALLED in kinds

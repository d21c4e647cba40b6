"""Which release of a payload is active: the highest that is here and healthy, unless a person went
back to an earlier one. Releases of one payload have one id, whatever fleets they are for.

A newer release is brought up beside the active one and takes over in one commit; the others wait,
superseded, and come back when it goes or fails. One release of a payload is brought up at a time.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

from nondum.host.core.effects import ProbeComponents
from nondum.host.core.events.payloads import PayloadFailed, PayloadFound, RetryAsked
from nondum.host.core.events.releases import (
    BesideRefused,
    PayloadResumed,
    PayloadSuperseded,
    RollbackAsked,
)
from nondum.host.core.records.component import ComponentRecord
from nondum.host.core.records.device import DeviceRecord
from nondum.host.core.records.payload import PayloadRecord, Rollback
from nondum.host.core.records.step import Step
from nondum.host.core.state import HostState
from nondum.host.lifecycle.device_allocation import handed_over
from nondum.host.lifecycle.turn import Turn
from nondum.sdk.errors import Problem

OVERRULED = "ROLLBACK"
"""What is refused for this alone, a person may let pass."""

STARTING = frozenset({Step.STORED, Step.PROBED})
"""The steps of a release that is being brought up: one of each payload at a time."""
_INSTALLED = STARTING | {Step.ACTIVE, Step.SUPERSEDED}


def other_releases(state: HostState, payload: PayloadRecord) -> Iterator[PayloadRecord]:
    """The other releases of a payload that are here, at whatever step."""
    return (
        other
        for other in state.payloads.values()
        if other.payload_id == payload.payload_id and other.key != payload.key
    )


def active_release(state: HostState, payload: PayloadRecord) -> PayloadRecord | None:
    """The other release of a payload that is active, if one is."""
    return next((o for o in other_releases(state, payload) if o.step is Step.ACTIVE), None)


def precedence(state: HostState, payload: PayloadRecord) -> tuple[int, bool]:
    """The order of releases: by number, but for one that a person went back to."""
    back = state.rollbacks.get(payload.payload_id)
    if back is not None and back.digest == payload.digest:
        return back.below, True
    return payload.release, False


def waits_behind(state: HostState, payload: PayloadRecord) -> PayloadRecord | None:
    """The release that an installed one has to wait for: one that is being brought up, or is
    active and takes precedence."""
    for other in other_releases(state, payload):
        if other.step in STARTING:
            return other
        is_higher = precedence(state, other) > precedence(state, payload)
        if other.step is Step.ACTIVE and is_higher:
            return other
    return None


def waits_for_recovery(found: HostState, payload: PayloadRecord) -> bool:
    """Whether a starting daemon brings up another release first: the one that was active, or the
    highest."""

    def place(one: PayloadRecord) -> tuple[bool, tuple[int, bool]]:
        return one.step is Step.ACTIVE, precedence(found, one)

    ahead = (
        o for o in other_releases(found, payload) if o.step in STARTING or o.step is Step.ACTIVE
    )
    return any(place(other) > place(payload) for other in ahead)


def twin(state: HostState, found: PayloadFound) -> PayloadRecord | None:
    """A payload that is here with the same release number and other content: one is not genuine."""
    return next(
        (
            other
            for other in state.payloads.values()
            if other.payload_id == found.payload_id
            and other.release == found.release
            and other.digest != found.digest
            and other.step not in (Step.REFUSED, Step.REMOVING)
        ),
        None,
    )


def can_go_back_to(state: HostState, payload: PayloadRecord) -> PayloadRecord | None:
    """The newest release before one, of those that wait or are refused only for being older."""
    earlier = [
        other
        for other in other_releases(state, payload)
        if other.release < payload.release and (other.step is Step.SUPERSEDED or _is_older(other))
    ]
    return max(earlier, key=lambda o: (o.release, o.step is Step.SUPERSEDED), default=None)


def settle(turn: Turn) -> Iterable[PayloadResumed]:
    """Resume releases that need not wait any longer: the highest of each payload none of whose
    releases is being brought up."""
    groups: dict[str, list[PayloadRecord]] = {}
    for payload in turn.state.payloads.values():
        if payload.step in _INSTALLED:
            groups.setdefault(payload.payload_id, []).append(payload)
    for group in groups.values():
        best = max(group, key=lambda payload: precedence(turn.state, payload))
        is_starting = any(payload.step in STARTING for payload in group)
        if best.step is Step.SUPERSEDED and not is_starting:
            yield PayloadResumed(best.key, _why_resumed(turn.state, best))


def waiting(payload: PayloadRecord, other: PayloadRecord) -> PayloadSuperseded:
    """What becomes of an installed release that has to wait for another one."""
    reason = f"{other.version} (release {other.release}) is {other.step.value}"
    return PayloadSuperseded(payload.key, other.key, reason)


def superseded(old: PayloadRecord, new: PayloadRecord) -> PayloadSuperseded:
    """What becomes of the active release as another one takes over."""
    reason = f"{new.version} (release {new.release}) took over"
    return PayloadSuperseded(old.key, new.key, reason)


def inherited(
    components: Iterable[ComponentRecord],
    before: Iterable[ComponentRecord],
    devices: Mapping[str, DeviceRecord],
) -> tuple[ComponentRecord, ...]:
    """The components of a release that takes over, with the ranks and devices of those before it.

    A device goes to the same need of the same component; what is left of them, as after a change of
    names, to the first need that it serves.
    """
    old = {component.id: component for component in before}
    ranked = (replace(new, rank=old[new.id].rank if new.id in old else 0) for new in components)
    return handed_over(tuple(ranked), old, devices)


def on_beside_refused(turn: Turn, event: BesideRefused) -> None:
    """Stop the active release first; it comes back if the other one fails."""
    payload = turn.state.payloads.get(event.payload)
    if payload is None or payload.step is not Step.STORED:
        return
    turn.events.append(event)
    old = active_release(turn.state, payload)
    if old is not None:
        turn.pending.append(PayloadSuperseded(old.key, payload.key, event.reason))
    after = old.key if old else ""
    turn.effects.append(ProbeComponents(payload.key, after=after, renamed=payload.renamed))


def on_rollback_asked(turn: Turn, event: RollbackAsked) -> bool:
    """Put an earlier release before all that are here. Says whether it must be read again, since it
    was refused."""
    payload = turn.state.payloads.get(event.payload)
    if payload is None or not (payload.step is Step.SUPERSEDED or _is_older(payload)):
        return False
    installed = [o.release for o in other_releases(turn.state, payload) if o.step in _INSTALLED]
    below = max(payload.release, event.from_release, *installed)
    back = Rollback(payload.digest, payload.release, below)
    turn.change(rollbacks={**turn.state.rollbacks, payload.payload_id: back})
    if payload.step is Step.REFUSED:
        return True
    turn.events.append(event)
    return False


def on_retry_asked(turn: Turn, payload: PayloadRecord, event: RetryAsked) -> None:
    """Go forward again to a release that a person had gone back from."""
    if payload.payload_id in turn.state.rollbacks:
        turn.events.append(event)
        forget_rollback(turn, payload)


def on_found(turn: Turn, found: PayloadFound) -> None:
    """A release that is plugged in again overrules an earlier going back from it; one that is still
    newer comes before both."""
    back = turn.state.rollbacks.get(found.payload_id)
    if back is not None and back.release < found.release <= back.below:
        forget_rollback(turn, found)


def on_withdrawn(turn: Turn, payload: PayloadRecord) -> None:
    """Going back to a release ends with it."""
    back = turn.state.rollbacks.get(payload.payload_id)
    if back is not None and back.digest == payload.digest:
        forget_rollback(turn, payload)


def forget_rollback(turn: Turn, payload: PayloadRecord | PayloadFound) -> None:
    """From now on the highest release counts again."""
    kept = {id: one for id, one in turn.state.rollbacks.items() if id != payload.payload_id}
    turn.change(rollbacks=kept)


def is_overruled(state: HostState, found: PayloadFound) -> bool:
    """Whether a person went back to this release, so that it may be older than others were."""
    back = state.rollbacks.get(found.payload_id)
    return back is not None and back.digest == found.digest


def gives_way(
    state: HostState, payload: PayloadRecord, problems: tuple[Problem, ...]
) -> Iterator[PayloadFailed]:
    """What becomes of an active release whose worker was given up: with another one to come back,
    it fails."""
    if any(other.step is Step.SUPERSEDED for other in other_releases(state, payload)):
        yield PayloadFailed(payload.key, problems)


def _is_older(payload: PayloadRecord) -> bool:
    return payload.step is Step.REFUSED and {p.code for p in payload.problems} == {OVERRULED}


def _why_resumed(state: HostState, payload: PayloadRecord) -> str:
    if precedence(state, payload)[1]:
        return "a person goes back to it"
    if active_release(state, payload) is not None:
        return "it is newer than the active one"
    return "the release that was active has stopped"

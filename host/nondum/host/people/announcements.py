"""What people are told of payloads and drives as they come, fail and go: sentences."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from packaging.version import Version

from nondum.host.core.events.catalogue import (
    CatalogueSetAside,
    CatalogueUnwritten,
    CatalogueWritten,
)
from nondum.host.core.events.daemon import SafeModeEntered, SafeModeLeft
from nondum.host.core.events.drives import (
    DriveFlapping,
    DriveLeftAlone,
    DriveRead,
    DriveRetried,
    DriveUnreadable,
)
from nondum.host.core.events.event import Event
from nondum.host.core.events.inputs import InputAmbiguous
from nondum.host.core.events.payloads import (
    PayloadActivated,
    PayloadFailed,
    PayloadRefused,
    PayloadWithdrawn,
    RetryAsked,
    WheelsStored,
)
from nondum.host.core.events.peers import PeerJoined, PeerLeft, PeerTurnedAway
from nondum.host.core.events.placement import (
    PayloadPlaced,
    PayloadSentAway,
    PayloadTaken,
    PlaceLost,
    PlaceMissing,
)
from nondum.host.core.events.releases import BesideRefused, PayloadResumed, RollbackAsked
from nondum.host.core.events.trust import (
    ClockDoubted,
    ClockRight,
    PayloadDistrusted,
    PayloadDoubted,
    TrustChanged,
    TrustFileRefused,
)
from nondum.host.core.events.workers import ConditionEnded, WorkerFaulted, WorkerStrained
from nondum.host.core.records.payload import PayloadRecord
from nondum.host.core.records.snapshot import Snapshot
from nondum.host.core.records.step import Step
from nondum.sdk.errors import Problem


def announced(event: Event, snapshot: Snapshot) -> str | None:
    """What is said of an event once `snapshot` has taken it in; None: nothing."""
    told = _of_payload(event, snapshot) or _of_place(event, snapshot)
    return told or _of_drive_or_worker(event) or _of_host(event)


def _of_payload(event: Event, snapshot: Snapshot) -> str | None:
    match event:
        case PayloadRefused():
            told = f"{_name(event.payload, snapshot)} is refused{_stays(event.payload, snapshot)}"
            return f"{told}: {_joined(event.problems)}"
        case PayloadFailed():
            told = (
                f"{_name(event.payload, snapshot)} does not work{_stays(event.payload, snapshot)}"
            )
            return f"{told}: {_joined(event.problems)}"
        case PayloadActivated():
            return "; ".join(_told_of_arrival(event, snapshot)) or None
        case WheelsStored() | PayloadResumed():
            return _brought_up(event, snapshot)
        case BesideRefused():
            name = _name(event.payload, snapshot)
            return f"{name} takes the place of the release before it, not beside it: {event.reason}"
        case RollbackAsked():
            name = _name(event.payload, snapshot)
            was = event.from_release
            return f"a person goes back to {name} (release {event.release}) from release {was}"
        case RetryAsked(why=why) if why:
            return f"{_name(event.payload, snapshot)} is tried again: {why}"
        case PayloadWithdrawn(rebuilt_as=new) if new:
            payload = _record(new, snapshot)
            name = payload.payload_id if payload else f"payload {new}"
            return f"{name} has changed on its drive, and is judged again"
        case PayloadWithdrawn():
            stays = _stays(event.payload, snapshot)  # it was refused, or waited
            return f"{_name(event.payload, snapshot)} is withdrawn: {event.reason}{stays}"
        case PayloadDistrusted():
            name = _name(event.payload, snapshot)
            return f"{name} is not trusted any more: {_joined(event.problems)}"
        case PayloadDoubted(problems=problems) if problems:
            name = _name(event.payload, snapshot)
            return f"{name} goes on without trust: {_joined(problems)}"
    return None


def _of_place(event: Event, snapshot: Snapshot) -> str | None:
    """A payload and the host that it runs on."""
    match event:
        case PayloadSentAway():
            return f"{_name(event.payload, snapshot)} is to run on {event.host}, not here"
        case PayloadPlaced():
            name = _name(event.payload, snapshot)
            return f"{name} runs on {event.host}, not here: {event.why}"
        case PlaceLost():
            name = _name(event.payload, snapshot)
            return f"{name} does not run on {event.host} any more: {event.reason}"
        case PlaceMissing():
            name = _name(event.payload, snapshot)
            return f"no host takes {name}: {_joined(event.problems)}"
        case PayloadTaken():
            name = _name(event.payload, snapshot)
            return f"{name} runs here for {event.host}, not there: {event.why}"
    return None


def _of_drive_or_worker(event: Event) -> str | None:
    match event:
        case DriveFlapping() | DriveLeftAlone():
            return _joined(event.problems)
        case WorkerStrained() | WorkerFaulted() | InputAmbiguous():
            return _joined(event.problems)
        case ConditionEnded():
            return f"{event.component} goes on without a condition: {_joined(event.problems)}"
        case DriveUnreadable():
            return f"drive {event.drive} cannot be used: {_joined(event.problems)}"
        case DriveRetried(why=why) if why:
            return f"drive {event.drive} is looked at again: {why}"
        case DriveRead(flaws=flaws) if flaws:
            return f"drive {event.drive}: {_joined(flaws)}"
        case DriveRead(payloads=(), certificates=0, trust_files=0):
            return f"drive {event.drive} carries no payload"
    return None


def _of_host(event: Event) -> str | None:
    """Trust, clock, catalogue, safe mode and peers."""
    match event:
        case TrustChanged():
            told = f"the trust file of {event.owner} has changed: version {event.version}"
            return f"{told}, from {event.source}"
        case ClockDoubted():
            return _joined(event.problems)
        case ClockRight():
            return "the clock is set: it is believed again"
        case TrustFileRefused():
            return f"a trust file from {event.source} is not taken: {_joined(event.problems)}"
        case SafeModeLeft(why=why):
            return f"safe mode is left: payloads are installed again{f', as {why}' if why else ''}"
        case CatalogueUnwritten() | CatalogueSetAside() | SafeModeEntered():
            return _joined(event.problems)
        case CatalogueWritten():
            return "the catalogue is written again, with all that happened meanwhile"
        case PeerJoined():
            return f"the host {event.host} is here"
        case PeerTurnedAway():
            return _joined(event.problems)
        case PeerLeft():
            return f"the host {event.host} is gone: {event.reason}"
    return None


def _told_of_arrival(event: PayloadActivated, snapshot: Snapshot) -> Iterator[str]:
    """What it replaces, and what its components were granted: people should know who listens."""
    new = _record(event.payload, snapshot)
    if new is not None and new.was:
        release = f"{new.payload_id} {new.version} (release {new.release})"
        yield f"{release} took over from release {new.was}{_lower_version(new, snapshot)}"
    for component in event.components:
        if component.permissions:
            yield f"{component.id} may use: {', '.join(sorted(component.permissions))}"


def _lower_version(new: PayloadRecord, snapshot: Snapshot) -> str:
    """That a newer release has a lower version: somebody may have built the wrong sources."""
    for old in snapshot.payloads:
        is_before = old.payload_id == new.payload_id and old.release == new.was < new.release
        if is_before and Version(new.version) < Version(old.version):
            return f", though its version is lower: {old.version} was active"
    return ""


def _brought_up(event: WheelsStored | PayloadResumed, snapshot: Snapshot) -> str | None:
    new, old = _record(event.payload, snapshot), _active_release(event.payload, snapshot)
    if new is None or new.step not in (Step.STORED, Step.PROBED):
        return None
    if old is not None:
        return f"{new.payload_id} {new.version} is being brought up beside {old.version}"
    if isinstance(event, PayloadResumed):
        return f"{new.payload_id} {new.version} comes back: {event.reason}"
    return None


def _stays(key: str, snapshot: Snapshot) -> str:
    """What goes on instead of a release that fails."""
    old = _active_release(key, snapshot)
    return f", {old.version} (release {old.release}) stays" if old is not None else ""


def _active_release(key: str, snapshot: Snapshot) -> PayloadRecord | None:
    """The active release of the payload that `key` is another release of."""
    payload = _record(key, snapshot)
    return next(
        (
            other
            for other in snapshot.payloads
            if payload is not None
            and other.payload_id == payload.payload_id
            and other.step is Step.ACTIVE
            and other.key != key
        ),
        None,
    )


def _record(key: str, snapshot: Snapshot) -> PayloadRecord | None:
    return next((payload for payload in snapshot.payloads if payload.key == key), None)


def _name(key: str, snapshot: Snapshot) -> str:
    """A payload's id, with its version where there are others; its key once it is gone."""
    payload = _record(key, snapshot)
    if payload is None:
        return f"payload {key}"
    is_one_of_many = sum(p.payload_id == payload.payload_id for p in snapshot.payloads) > 1
    has_version = is_one_of_many and payload.version  # one that was refused unread has none
    return f"{payload.payload_id} {payload.version}" if has_version else payload.payload_id


def _joined(problems: Iterable[Problem]) -> str:
    return "; ".join(str(problem) for problem in problems)

"""What people are told of payloads and drives as they come, fail and go: sentences."""

from __future__ import annotations

from collections.abc import Iterable

from nondum.host.catalogue.records import Snapshot
from nondum.host.events import (
    DriveFlapping,
    DriveRead,
    DriveUnreadable,
    Event,
    PayloadFailed,
    PayloadPlaced,
    PayloadRefused,
    PayloadSentAway,
    PayloadTaken,
    PayloadWithdrawn,
    PeerJoined,
    PeerLeft,
    PeerTurnedAway,
    PlaceLost,
    PlaceMissing,
    WorkerStrained,
)
from nondum.sdk.errors import Problem


def announced(event: Event, snapshot: Snapshot) -> str | None:
    """What is said of an event once `snapshot` has taken it in; None: nothing."""
    match event:
        case PayloadRefused():
            return f"{_name(event.payload, snapshot)} is refused: {_joined(event.problems)}"
        case PayloadFailed():
            return f"{_name(event.payload, snapshot)} does not work: {_joined(event.problems)}"
        case PayloadWithdrawn():
            return f"{_name(event.payload, snapshot)} is withdrawn: {event.reason}"
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
        case DriveFlapping():
            return _joined(event.problems)
        case WorkerStrained():
            return _joined(event.problems)
        case DriveUnreadable():
            return f"drive {event.drive} cannot be used: {_joined(event.problems)}"
        case PeerJoined():
            return f"the host {event.host} is here"
        case PeerTurnedAway():
            return _joined(event.problems)
        case PeerLeft():
            return f"the host {event.host} is gone: {event.reason}"
        case DriveRead(payloads=(), certificates=0):
            return f"drive {event.drive} carries no payload"
    return None


def _name(key: str, snapshot: Snapshot) -> str:
    """A payload's id; its key once it is gone."""
    return next((p.payload_id for p in snapshot.payloads if p.key == key), f"payload {key}")


def _joined(problems: Iterable[Problem]) -> str:
    return "; ".join(str(problem) for problem in problems)

"""Events as the journal keeps them."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence

from nondum.host.core.events.event import Event
from nondum.host.core.events.payloads import PayloadFound, RetryAsked
from nondum.host.core.events.releases import RollbackAsked
from nondum.host.core.records.journal import JournalEntry
from nondum.host.core.records.moment import Moment
from nondum.host.core.records.payload import PayloadRecord
from nondum.host.core.state import HostState
from nondum.host.core.transitions import TRANSITIONS

_SUBJECTS = ("component", "goal", "unit", "input", "device", "drive", "kind", "host", "source")

_ASKED = (RetryAsked, RollbackAsked)
_STEPS = {event: row.to.value for (_, event), row in TRANSITIONS.items() if event not in _ASKED}
"""The step that an event leads to; where people ask for something, that depends."""


def entries_of(
    told: Sequence[tuple[Event, Moment]], before: HostState, after: HostState, boot: str
) -> Iterator[JournalEntry]:
    """The entries of events that led from one state to another."""
    payloads = {**before.payloads, **after.payloads}
    found = {e.payload: e.payload_id for e, _ in told if isinstance(e, PayloadFound)}
    for event, at in told:
        detail = event.to_dict()
        # What is wrong with a payload as it is found is told by the refusal that follows.
        is_found = isinstance(event, PayloadFound)
        problems = () if is_found else getattr(event, "problems", ())
        detail.pop("problems", None)
        detail.pop("description", None)
        yield JournalEntry(
            id=0,
            at=at,
            boot=boot,
            event=event.name,
            subject=_subject(event, payloads, found),
            step=_STEPS.get(type(event), ""),
            problems=tuple(problems),
            detail=detail,
        )


def _subject(event: Event, payloads: dict[str, PayloadRecord], found: dict[str, str]) -> str:
    """Payload id, component, device, drive or goal that an event is about."""
    names = {field.name for field in dataclasses.fields(event)}
    if "payload" in names and "component" not in names:
        key: str = getattr(event, "payload")  # noqa: B009  # only some events have the field
        known = payloads.get(key)
        return known.payload_id if known else found.get(key, key)
    subject = next((name for name in _SUBJECTS if name in names), None)
    return str(getattr(event, subject)) if subject else ""

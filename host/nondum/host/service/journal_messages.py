"""Writes what happens on a host to systemd's journal: announcements to people, and problems."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Sequence

from nondum.host.core.events.daemon import HostStarted, HostStopped
from nondum.host.core.events.drives import DriveInserted, DriveRemoved
from nondum.host.core.events.event import Event
from nondum.host.core.events.goals import GoalEnded, GoalGiven, GoalReached
from nondum.host.core.events.payloads import PayloadActivated
from nondum.host.core.events.workers import WorkerExited, WorkerLogged
from nondum.host.core.records.snapshot import Snapshot
from nondum.host.people.announcements import announced
from nondum.sdk.errors import Problem

FIELDS = ("component", "payload", "drive", "device", "goal")
"""Attributes of events that become fields: `NONDUM_COMPONENT`, and so on."""
LOGGED = {"WARNING": logging.WARNING, "ERROR": logging.ERROR, "CRITICAL": logging.CRITICAL}
"""Levels of plugins' own lines that go to the journal; `nondum logs` has the others, too."""

log = logging.getLogger("nondum.events")


class JournalMessages:
    """Logs events of the bus to the journal."""

    def __init__(self, snapshot: Callable[[], Snapshot]) -> None:
        self._snapshot = snapshot

    def on_event(self, event: Event) -> None:
        """Log an event that a person or a program may look for."""
        if isinstance(event, WorkerLogged):
            if (level := LOGGED.get(event.level.upper())) is not None:
                extra = {"journal": [*fields_of(event, self._snapshot())]}
                log.log(level, "%s: %s", event.component, event.message, extra=extra)
            return
        snapshot = self._snapshot()
        problems: Sequence[Problem] = getattr(event, "problems", ())
        said = announced(event, snapshot) or _logged(event) or "; ".join(map(str, problems))
        if said:
            level = logging.WARNING if problems else logging.INFO
            extra = {"journal": [*fields_of(event, snapshot)]}
            log.log(level, "%s", said, extra=extra)


def _logged(event: Event) -> str:
    """The line for an event that is not announced, but that people may look for later."""
    match event:
        case DriveInserted():
            return f"drive {event.drive} was plugged in"
        case DriveRemoved():
            return f"drive {event.drive} was pulled"
        case PayloadActivated():
            return f"at work: {', '.join(component.id for component in event.components)}"
        case WorkerExited():
            return f"{event.component} ended: {event.reason}"
        case GoalGiven():
            return f"goal {event.goal}: {event.text}"
        case GoalReached():
            return f"goal {event.goal} is reached"
        case GoalEnded():
            return f"goal {event.goal} has ended: {event.reason}"
        case HostStarted():
            return f"host {event.host} has started"
        case HostStopped():
            return f"host {event.host} ends as it was told to"
    return ""


def fields_of(event: Event, snapshot: Snapshot) -> Iterator[tuple[str, str]]:
    """The fields by which an event is found: `journalctl NONDUM_CODE=NO_MEMORY`."""
    yield "NONDUM_EVENT", event.name
    ids = {payload.key: payload.payload_id for payload in snapshot.payloads}
    for name in FIELDS:
        if value := getattr(event, name, ""):
            yield f"NONDUM_{name.upper()}", ids.get(value, value) if name == "payload" else value
    problems: Sequence[Problem] = getattr(event, "problems", ())
    yield from (("NONDUM_CODE", code) for code in dict.fromkeys(p.code for p in problems))

"""What happens on a host, told to systemd's journal: what people are told, and what is amiss."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Sequence

from nondum.host.announcements import announced
from nondum.host.catalogue.records import Snapshot
from nondum.host.events import Event, WorkerLogged
from nondum.sdk.errors import Problem

FIELDS = ("component", "payload", "drive", "device", "goal")
"""Attributes of events that become fields: `NONDUM_COMPONENT`, and so on."""
LOGGED = {"WARNING": logging.WARNING, "ERROR": logging.ERROR, "CRITICAL": logging.CRITICAL}
"""Levels of plugins' own lines that go to the journal; `nondum logs` has the others, too."""

log = logging.getLogger("nondum.events")


class Telling:
    """Listens to the bus, and logs."""

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
        said = announced(event, snapshot) or "; ".join(map(str, problems))
        if said or event.name.startswith("Host"):
            level = logging.WARNING if problems else logging.INFO
            extra = {"journal": [*fields_of(event, snapshot)]}
            log.log(level, "%s", said or event.name, extra=extra)


def fields_of(event: Event, snapshot: Snapshot) -> Iterator[tuple[str, str]]:
    """The fields by which an event is found: `journalctl NONDUM_CODE=NO_MEMORY`."""
    yield "NONDUM_EVENT", event.name
    ids = {payload.key: payload.payload_id for payload in snapshot.payloads}
    for name in FIELDS:
        if value := getattr(event, name, ""):
            yield f"NONDUM_{name.upper()}", ids.get(value, value) if name == "payload" else value
    problems: Sequence[Problem] = getattr(event, "problems", ())
    yield from (("NONDUM_CODE", code) for code in dict.fromkeys(p.code for p in problems))

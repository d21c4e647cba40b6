"""Tells the mind, and the workers' streams, what the bus tells."""

from __future__ import annotations

from nondum.host.catalogue.catalogue import Catalogue
from nondum.host.core.events.catalogue import Recomposed
from nondum.host.core.events.daemon import HostStarted
from nondum.host.core.events.drives import DriveRemoved
from nondum.host.core.events.event import Event
from nondum.host.core.events.payloads import PayloadActivated, PayloadWithdrawn, RetryAsked
from nondum.host.mind.frames import mounts_of_all
from nondum.host.mind.mind import Mind
from nondum.host.mind.mounts import MountUpdates
from nondum.host.people.announcements import announced
from nondum.host.people.goal_files import of_people
from nondum.host.workers.workers import Workers

_ENDS = DriveRemoved | PayloadWithdrawn | PayloadActivated | RetryAsked
"""What was told of a drive or payload before these is of no interest any more."""


class MindListener:
    """Subscribe `on_event`."""

    def __init__(self, catalogue: Catalogue, mind: Mind, workers: Workers) -> None:
        self._catalogue, self._mind, self._workers = catalogue, mind, workers
        self._mounts = MountUpdates(workers.remount, mind.after_tick)

    def on_event(self, event: Event) -> None:
        """A start or a recomposition is a new snapshot; everything else is news."""
        if isinstance(event, HostStarted | Recomposed):
            snapshot = self._catalogue.snapshot()
            self._mounts.see(mounts_of_all(snapshot))
            self._workers.streams.connect(dict(snapshot.connections))
            self._mind.see(snapshot)
            if isinstance(event, HostStarted):
                self._mind.restore(of_people(snapshot.goals))
            return
        about = _about(event)
        if isinstance(event, _ENDS):
            self._mind.people.end(about)
        sentence = announced(event, self._catalogue.snapshot())
        if sentence is not None:
            is_gone = isinstance(event, DriveRemoved | PayloadWithdrawn)
            self._mind.people.tell(sentence, "" if is_gone else about)
        self._mind.on_event(event)


def _about(event: Event) -> str:
    """The drive or payload that an event is about, if it is about one."""
    names = ((kind, getattr(event, kind, "")) for kind in ("drive", "payload"))
    return next((f"{kind} {name}" for kind, name in names if name), "")

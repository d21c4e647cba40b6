"""Two releases of one payload: one waits, is tried beside the other, or is gone back to."""

from __future__ import annotations

from nondum.host.core.events.event import Event
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen


@frozen
class BesideRefused(Event):
    """A release cannot run beside the active one, which has to stop first."""

    payload: str
    reason: str


@frozen
class TrialFailed(Event):
    """A worker ended that was tried beside the active one: its release does not work."""

    payload: str
    component: str
    problems: tuple[Problem, ...]


@frozen
class PayloadSuperseded(Event):
    """Another release of the payload is active or becomes active; this one waits beside it."""

    payload: str
    by: str
    """Key of the other one."""
    reason: str


@frozen
class PayloadResumed(Event):
    """A release that waited beside another one is wanted: it is brought up (again)."""

    payload: str
    reason: str


@frozen
class RollbackAsked(Event):
    """A person asked for an earlier release of a payload, this once: rollback protection lets it
    pass until it is unplugged or a newer one comes."""

    payload: str
    """Key of the earlier release."""
    release: int
    from_release: int

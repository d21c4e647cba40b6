"""Payloads run on other hosts: sent there, placed, or taken from there."""

from __future__ import annotations

from nondum.host.core.events.event import Event
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen


@frozen
class PayloadSentAway(Event):
    """A person wants the payload on another host: it leaves this one, and its drive stays in."""

    payload: str
    host: str
    """The other one."""
    problems: tuple[Problem, ...]
    """What is told of it here from now on."""


@frozen
class PayloadPlaced(Event):
    """A payload that does not run here runs on a peer now."""

    payload: str
    host: str
    """The peer."""
    why: str


@frozen
class PlaceLost(Event):
    """A payload does not run any more on the peer that it was placed on."""

    payload: str
    host: str
    """The peer."""
    reason: str


@frozen
class PlaceMissing(Event):
    """No peer that is there takes a payload that does not run here."""

    payload: str
    problems: tuple[Problem, ...]
    """What each of them has said, `where` its name."""


@frozen
class PayloadTaken(Event):
    """A peer's payload runs here, since it does not run there."""

    payload: str
    host: str
    """The peer."""
    why: str

"""Payloads run on other hosts: sent there, placed, or taken from there."""

from __future__ import annotations

from dataclasses import dataclass

from nondum.host.core.events.event import Event
from nondum.sdk.errors import Problem


@dataclass(frozen=True, slots=True)
class PayloadSentAway(Event):
    """A person wants the payload on another host: it leaves this one, and its drive stays in."""

    payload: str
    host: str
    """The other one."""
    problems: tuple[Problem, ...]
    """What is told of it here from now on."""


@dataclass(frozen=True, slots=True)
class PayloadPlaced(Event):
    """A payload that does not run here runs on a peer now."""

    payload: str
    host: str
    """The peer."""
    why: str


@dataclass(frozen=True, slots=True)
class PlaceLost(Event):
    """A payload does not run any more on the peer that it was placed on."""

    payload: str
    host: str
    """The peer."""
    reason: str


@dataclass(frozen=True, slots=True)
class PlaceMissing(Event):
    """No peer that is there takes a payload that does not run here."""

    payload: str
    problems: tuple[Problem, ...]
    """What each of them has said, `where` its name."""


@dataclass(frozen=True, slots=True)
class PayloadTaken(Event):
    """A peer's payload runs here, since it does not run there."""

    payload: str
    host: str
    """The peer."""
    why: str

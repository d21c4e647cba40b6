"""The trust file changes, and with it what is trusted; the clock by which it is judged."""

from __future__ import annotations

from nondum.host.core.events.event import Event
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen


@frozen
class TrustRead(Event):
    """A daemon that starts has read and verified the trust file that it goes by."""

    owner: str
    version: int
    first: str
    """Who vouches for the first one, in words: `nondum.host.trust.anchors.Origin`."""


@frozen
class TrustChanged(Event):
    """Another version of the trust file is active, and safe on disk."""

    owner: str
    version: int
    source: str
    """The drive that brought it, or `person`."""


@frozen
class TrustFileRefused(Event):
    """A trust file was not taken; the active one stays."""

    source: str
    """The drive that brought it."""
    problems: tuple[Problem, ...]


@frozen
class PayloadDistrusted(Event):
    """A payload that is here is not trusted any more: its key was revoked, say. It is withdrawn."""

    payload: str
    problems: tuple[Problem, ...]


@frozen
class PayloadDoubted(Event):
    """A payload that is here is not trusted any more, and stays all the same; or, without
    `problems`, is trusted again."""

    payload: str
    problems: tuple[Problem, ...]


@frozen
class ClockDoubted(Event):
    """The wall clock shows a moment that is certainly past."""

    problems: tuple[Problem, ...]


@frozen
class ClockRight(Event):
    """The wall clock, which was doubted, may be right again."""

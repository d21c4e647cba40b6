"""The daemon starts and ends, and leaves payloads alone if others died before it."""

from __future__ import annotations

from typing import ClassVar

from nondum.host.core.events.event import Event
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen


@frozen
class HostStarted(Event):
    """The daemon is up; `recovered` says what it found half done and did about it."""

    host: str
    recovered: tuple[str, ...] = ()


@frozen
class HostStopped(Event):
    """The daemon was told to end, and did."""

    host: str


@frozen
class SafeModeEntered(Event):
    """The daemon leaves payloads alone, as it has started."""

    host: str
    problems: tuple[Problem, ...]
    """Which, and why."""


@frozen
class SafeModeLeft(Event):
    """Payloads are taken in again: a person asked for it, or the host does by itself."""

    host: str
    why: str = ""
    """Why the host does; empty: a person asked."""


@frozen
class TrialDue(Event):
    """The daemon has lived long enough to try again something that others died of."""

    JOURNALLED: ClassVar[bool] = False

    host: str


@frozen
class HostStable(Event):
    """The daemon has lived for a while beside what others had died of."""

    host: str

"""Behaviours start, take effect and end."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import ClassVar

from nondum.host.core.events.event import Event
from nondum.sdk.frozen import frozen


@frozen
class BehaviourStarted(Event):
    """A behaviour was asked to run."""

    component: str
    behaviour: str
    call_id: int
    arguments: Mapping[str, str] = field(default_factory=dict)


@frozen
class BehaviourEstablished(Event):
    """A lasting behaviour's effects begin to hold."""

    component: str
    behaviour: str
    call_id: int


@frozen
class BehaviourProgressed(Event):
    """A behaviour said how far it is."""

    JOURNALLED: ClassVar[bool] = False
    component: str
    behaviour: str
    call_id: int
    fraction: float
    text: str = ""


@frozen
class BehaviourEnded(Event):
    """A behaviour ended, however it ended."""

    component: str
    behaviour: str
    call_id: int
    outcome: str
    """`SUCCEEDED`, `FAILED` or `HALTED`."""
    reason: str = ""
    """Why it failed or was halted; what it answered, if it succeeded."""


@frozen
class BehavioursHalted(Event):
    """A tick of the task tree took behaviours down: all that one decision halted."""

    tick: int
    halted: Mapping[str, str] = field(default_factory=dict)
    """Actions whose behaviours were asked to end → why."""
    lost: Mapping[str, str] = field(default_factory=dict)
    """Actions whose behaviours had ended by themselves or with their component → how."""

"""Facts become known and are forgotten, as components and other hosts say."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import Any, ClassVar

from nondum.host.core.events.event import Event
from nondum.sdk.frozen import frozen


@frozen
class FactKnown(Event):
    """A component says that something is so."""

    JOURNALLED: ClassVar[bool] = False
    component: str
    predicate: str
    arguments: tuple[str, ...]
    value: Any = None
    """`[type, header]` of a valued fact, as it travels."""


@frozen
class FactForgotten(Event):
    """A component says that something is not so, or not known, any more."""

    JOURNALLED: ClassVar[bool] = False
    component: str
    predicate: str
    arguments: tuple[str, ...]


@frozen
class StreamFlowing(Event):
    """A stream's first message has gone out, or (not `flowing`) it has ended or stalled."""

    JOURNALLED: ClassVar[bool] = False
    component: str
    stream: str
    """Full object name."""
    flowing: bool


@frozen
class UnitsTaken(Event):
    """What others have in use, as one host tells it: all of it, each time."""

    JOURNALLED: ClassVar[bool] = False
    host: str
    """Who tells."""
    taken: Mapping[str, str] = field(default_factory=dict)
    """Fact that does not hold, `idle` or `free` → the host that uses what it is about."""

"""Optional inputs are given a stream."""

from __future__ import annotations

from nondum.host.core.events.event import Event
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen


@frozen
class InputAmbiguous(Event):
    """Several streams fit an optional input, and the configuration does not say which it gets."""

    component: str
    problems: tuple[Problem, ...]


@frozen
class InputConnected(Event):
    """A person said which stream an optional input is to get."""

    input: str
    """`component.unit.slot`"""
    stream: str
    """Empty: the host picks again."""

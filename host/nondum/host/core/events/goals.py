"""Goals are given, get plans, and end."""

from __future__ import annotations

from nondum.host.core.events.event import Event
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen


@frozen
class GoalGiven(Event):
    """A person, or something that speaks for one, wants something."""

    goal: str
    """Id of the goal on this host."""
    text: str
    kind: str
    """`achieve` or `maintain`."""
    pddl: str
    """The condition, `self` replaced by the host's name."""
    priority: int = 0


@frozen
class PlanMade(Event):
    """A goal has a plan."""

    goal: str
    revision: int
    steps: tuple[str, ...]
    reason: str = ""


@frozen
class PlanMissing(Event):
    """A goal has no plan as things are; it waits, suspended."""

    goal: str
    problems: tuple[Problem, ...]


@frozen
class GoalReached(Event):
    """A goal holds."""

    goal: str


@frozen
class GoalEnded(Event):
    """A goal is not pursued any more: achieved, halted or replaced."""

    goal: str
    reason: str

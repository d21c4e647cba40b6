"""Goals are given, get plans, and end."""

from __future__ import annotations

from dataclasses import dataclass

from nondum.host.core.events.event import Event
from nondum.sdk.errors import Problem


@dataclass(frozen=True, slots=True)
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


@dataclass(frozen=True, slots=True)
class PlanMade(Event):
    """A goal has a plan."""

    goal: str
    revision: int
    steps: tuple[str, ...]
    reason: str = ""


@dataclass(frozen=True, slots=True)
class PlanMissing(Event):
    """A goal has no plan as things are; it waits, suspended."""

    goal: str
    problems: tuple[Problem, ...]


@dataclass(frozen=True, slots=True)
class GoalReached(Event):
    """A goal holds."""

    goal: str


@dataclass(frozen=True, slots=True)
class GoalEnded(Event):
    """A goal is not pursued any more: achieved, halted or replaced."""

    goal: str
    reason: str

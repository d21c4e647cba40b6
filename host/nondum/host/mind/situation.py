"""What a search for a plan depends on, and what can come of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import TypeAlias

from nondum.host.mind.diagnosis import Seen
from nondum.host.mind.lack import Need
from nondum.planning.execute.independence import Reservation
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen
from nondum.sdk.planner import GroundTask, Plan


@frozen
class OtherPlans:
    """The plans that are carried out for other goals."""

    firm: tuple[Reservation, ...] = ()
    """Those of more urgent goals: they are left alone."""
    yielding: tuple[Reservation, ...] = ()
    """Those of less urgent ones: they are put aside where the goal cannot be had beside them."""
    with_firm: frozenset[str] = frozenset()
    """What holds while only the firm ones are carried out."""
    with_all: frozenset[str] = frozenset()
    """What holds while all of them are."""

    @property
    def all(self) -> tuple[Reservation, ...]:
        """All of them."""
        return self.firm + self.yielding


@frozen
class Situation:
    """What a search depends on: the same situation gives the same answer."""

    goal: str
    """Id of the goal."""
    revision: int
    facts: frozenset[str]
    """What holds when no lasting behaviour runs."""
    excluded: frozenset[str]
    """Actions that failed too often to be planned with for now."""
    others: OtherPlans = OtherPlans()

    def is_like(self, other: Situation) -> bool:
        """Whether only facts differ: a search goes on, and its plan is checked when it comes."""
        return self._but_for_facts() == other._but_for_facts()

    def _but_for_facts(self) -> tuple[object, ...]:
        return self.goal, self.revision, self.excluded, self.others.firm, self.others.yielding


@frozen
class Planned:
    """A plan for a goal, in the task that it is valid in."""

    situation: Situation
    task: GroundTask
    plan: Plan
    planner: str = ""
    took_s: float = 0.0
    left_out: Mapping[str, Problem] = field(default_factory=dict)
    """Components that were not planned with, for they have too many ways to act."""
    beside: tuple[Reservation, ...] = ()
    """The plans whose effects it begins with."""
    puts_aside: Mapping[str, str] = field(default_factory=dict)
    """Goal that cannot be pursued beside it → what both need."""

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the steps' actions."""
        return tuple(self.task.actions[step].name for step in self.plan.steps)


@frozen
class NoPlan:
    """There is none, or none was found; the problems say why."""

    situation: Situation
    problems: tuple[Problem, ...]
    left_out: Mapping[str, Problem] = field(default_factory=dict)
    """Components that were not planned with, for they have too many ways to act."""
    needs: tuple[Need, ...] = ()
    """What is missing, as far as that is why."""


@frozen
class Waits:
    """There is a plan, and more urgent goals keep it from being carried out."""

    situation: Situation
    behind: Mapping[str, str]
    """Goal → what both need."""
    left_out: Mapping[str, Problem] = field(default_factory=dict)
    """Components that were not planned with, for they have too many ways to act."""


Outcome: TypeAlias = Planned | NoPlan | Waits


@frozen
class Past:
    """What is remembered from before a search."""

    seen: tuple[Seen, ...] = ()
    """The components that were here: they may bring what is missing."""
    failures: Mapping[str, str] = field(default_factory=dict)
    """Actions that are excluded, and how they failed."""
    left_out: Mapping[str, Problem] = field(default_factory=dict)
    """Components that are known to have too many ways to act."""

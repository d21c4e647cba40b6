"""The seam that planners are plugged in behind: a ground task in, a typed answer out.

A planner is an entry point in group `nondum.planners` that loads to a class with a `speaks`
attribute and a `plan` method. It runs in a process of its own and is killed when it overruns.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Protocol, TypeAlias, runtime_checkable


@dataclass(frozen=True, slots=True)
class GroundAction:
    """An action with all its parameters bound. Facts are indices into `GroundTask.facts`."""

    name: str
    """`schema obj obj …`, unique in its task; the schema is `plugin.action`."""
    precondition: frozenset[int]
    add: frozenset[int]
    delete: frozenset[int]
    cost: int = 1

    @property
    def schema(self) -> str:
        """The schema's name: `plugin.drive`."""
        return self.name.split(" ", 1)[0]

    @property
    def arguments(self) -> tuple[str, ...]:
        """The objects, in the order of the schema's parameters; the first is the actor."""
        return tuple(self.name.split(" ")[1:])


@dataclass(frozen=True, slots=True)
class GroundTask:
    """A STRIPS task: positive facts only; a negated fact that matters has a twin `not-p`."""

    facts: tuple[str, ...]
    """`predicate obj obj …` by index."""
    init: frozenset[int]
    goal: frozenset[int]
    actions: tuple[GroundAction, ...]


@dataclass(frozen=True, slots=True)
class Plan:
    """Indices into `GroundTask.actions`, in order."""

    steps: tuple[int, ...]
    cost: int


@dataclass(frozen=True, slots=True)
class AlreadyTrue:
    """The goal holds in the initial state."""


@dataclass(frozen=True, slots=True)
class Unsolvable:
    """There is no plan, and this is why: never said without a proof."""

    proof: str
    """`relaxed` (goal facts outside the delete-relaxed reachable set) or `exhausted`."""
    facts: tuple[str, ...] = ()
    """The goal facts that cannot be reached, where the proof names them."""


@dataclass(frozen=True, slots=True)
class GaveUp:
    """No answer: not the same as impossible."""

    why: str


Answer: TypeAlias = Plan | AlreadyTrue | Unsolvable | GaveUp


@runtime_checkable
class Planner(Protocol):
    """What a planner plugin provides."""

    speaks: ClassVar[str]
    """`ground`: `plan` takes a `GroundTask`."""

    def plan(self, task: GroundTask, deadline_s: float) -> Answer:
        """Search for at most about `deadline_s` seconds."""
        ...

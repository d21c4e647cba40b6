"""What exploring finds: actions, their conditional effects and rules with objects for variables."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from nondum.planning.ground.relations import FactTable, Row
from nondum.planning.merge.domain import Action, DerivedRule
from nondum.planning.pddl.normal import Condition


@dataclass(slots=True)
class Change:
    """One binding of a conditional effect, in numbers of facts."""

    condition: Condition
    names: Mapping[str, str]
    """What the variables of `condition.further` stand for."""
    positive: frozenset[int]
    negative: frozenset[int]
    add: frozenset[int]
    delete: frozenset[int]


@dataclass(slots=True)
class Instance:
    """An action with its parameters bound, in numbers of facts."""

    action: Action
    row: Row
    """The objects, in the order of the parameters."""
    positive: frozenset[int]
    negative: frozenset[int]
    """Facts that must be false."""
    add: frozenset[int]
    delete: frozenset[int]
    """Without what it also adds: adding wins."""
    changes: list[Change] = field(default_factory=list)

    @property
    def name(self) -> str:
        """`plugin.action object …`."""
        return " ".join((self.action.name, *self.row))

    @property
    def names(self) -> dict[str, str]:
        """Parameter → object."""
        parameters = (parameter.name for parameter in self.action.parameters)
        return dict(zip(parameters, self.row, strict=True))


@dataclass(frozen=True, slots=True)
class Derivation:
    """A rule with its variables bound, in numbers of facts."""

    rule: DerivedRule
    names: Mapping[str, str]
    head: int
    positive: frozenset[int]
    negative: frozenset[int]


@dataclass(frozen=True, slots=True)
class Exploration:
    """The delete-relaxed reachable part of a domain."""

    table: FactTable
    believed: frozenset[int]
    """The facts it began with, those about objects that are not there left out."""
    reached: frozenset[int]
    instances: tuple[Instance, ...]
    """Sorted by name."""
    derivations: tuple[Derivation, ...]
    members: Mapping[str, frozenset[str]]
    """Type → the objects of it."""

    @property
    def reachable(self) -> frozenset[str]:
        """The facts that can become true, as text."""
        return frozenset(map(self.table.text, self.reached))

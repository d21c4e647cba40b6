"""What exploring finds: facts by number, and actions, their conditional effects and rules bound."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TypeAlias

from nondum.planning.merge.domain import Action, DerivedRule
from nondum.planning.pddl.normal import Condition
from nondum.sdk.frozen import frozen

Row: TypeAlias = tuple[str, ...]
"""The arguments of a fact."""
Literals: TypeAlias = frozenset[int]
"""A conjunction: the number of each fact that must hold, and `~number` of each that must not."""


@dataclass(slots=True)
class FactTable:
    """Every fact that is spoken of, numbered in the order of its first mention."""

    facts: list[tuple[str, Row]] = field(default_factory=list)
    _numbers: defaultdict[str, dict[Row, int]] = field(default_factory=lambda: defaultdict(dict))

    def of(self, predicate: str) -> Mapping[Row, int]:
        """The facts of one predicate with their numbers; it grows as facts are mentioned."""
        return self._numbers[predicate]

    def number(self, predicate: str, row: Row) -> int:
        """The number of a fact; a new one if it was never mentioned."""
        numbers = self._numbers[predicate]
        found = numbers.get(row)
        if found is None:
            found = numbers[row] = len(self.facts)
            self.facts.append((predicate, row))
        return found

    def text(self, number: int) -> str:
        """A fact as text."""
        predicate, row = self.facts[number]
        return " ".join((predicate, *row))


@dataclass(slots=True)
class Change:
    """One binding of a conditional effect, in numbers of facts."""

    condition: Condition
    names: Mapping[str, str]
    """What the variables of `condition.further` stand for."""
    literals: Literals
    """The literals of `condition`."""
    add: frozenset[int]
    delete: frozenset[int]


@dataclass(slots=True)
class Instance:
    """An action with its parameters bound, in numbers of facts."""

    action: Action
    row: Row
    """The objects, in the order of the parameters."""
    literals: Literals
    """Those of the precondition."""
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


@frozen
class Derivation:
    """A rule with its variables bound, in numbers of facts."""

    rule: DerivedRule
    names: Mapping[str, str]
    head: int
    literals: Literals
    """Those of the condition."""


@frozen
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

"""Facts as numbers, and the tables in which a join looks them up."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

Row: TypeAlias = tuple[str, ...]
"""The arguments of a fact."""
Key: TypeAlias = tuple[str, tuple[int, ...]]
"""A predicate, and the positions that are looked up."""


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


class Relations:
    """Rows by predicate and by the values at those positions that somebody looks up."""

    def __init__(self) -> None:
        self._rows: defaultdict[str, list[Row]] = defaultdict(list)
        self._tables: dict[Key, defaultdict[Row, list[Row]]] = {}
        self._of: defaultdict[str, list[tuple[tuple[int, ...], defaultdict[Row, list[Row]]]]]
        self._of = defaultdict(list)

    def add(self, predicate: str, row: Row) -> None:
        """Add a fact that is not there yet."""
        self._rows[predicate].append(row)
        for positions, table in self._of[predicate]:
            table[tuple([row[position] for position in positions])].append(row)

    def table(self, key: Key) -> Mapping[Row, Sequence[Row]]:
        """Values at the key's positions → rows; it grows as rows are added."""
        if key not in self._tables:
            predicate, positions = key
            table = self._tables[key] = defaultdict(list)
            for row in self._rows[predicate]:
                table[tuple([row[position] for position in positions])].append(row)
            self._of[predicate].append((positions, table))
        return self._tables[key]

"""Matching facts with conditions that are bound in part: for people's questions, not for speed."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

from nondum.planning.ground.instances import Row
from nondum.planning.pddl.syntax import Atom
from nondum.sdk.frozen import frozen

Binding: TypeAlias = dict[str, str]


@dataclass(slots=True)
class FactIndex:
    """Facts by predicate, and by predicate, position and object."""

    rows: defaultdict[str, list[Row]] = field(default_factory=lambda: defaultdict(list))
    index: defaultdict[tuple[str, int, str], list[Row]] = field(
        default_factory=lambda: defaultdict(list)
    )

    def add(self, predicate: str, arguments: Row) -> None:
        """Add a fact that is not there yet."""
        self.rows[predicate].append(arguments)
        for position, argument in enumerate(arguments):
            self.index[predicate, position, argument].append(arguments)

    def candidates(self, pattern: Pattern, binding: Mapping[str, str]) -> Sequence[Row]:
        """The smallest list of facts that contains all that fit the pattern."""
        found: Sequence[Row] = self.rows[pattern.predicate]
        for position, term in enumerate(pattern.terms):
            value = binding.get(term) if term[0] == "?" else term
            if value is not None:
                bucket = self.index.get((pattern.predicate, position, value), ())
                if len(bucket) < len(found):
                    found = bucket
        return found


@frozen
class Pattern:
    """A condition `(predicate term …)`; terms with `?` are variables."""

    predicate: str
    terms: Row

    @classmethod
    def of(cls, atom: Atom) -> Pattern:
        """An atom for matching."""
        return cls(atom.predicate, tuple(term.name for term in atom.terms))


def matched(
    pattern: Pattern, arguments: Row, binding: Binding, domains: Mapping[str, frozenset[str]]
) -> Binding | None:
    """The binding extended so that the pattern becomes the fact; None if it cannot."""
    extended = binding
    for term, argument in zip(pattern.terms, arguments, strict=True):
        if term[0] != "?":
            if term != argument:
                return None
            continue
        value = extended.get(term)
        if value is None:
            if argument not in domains[term]:
                return None
            if extended is binding:
                extended = dict(binding)
            extended[term] = argument
        elif value != argument:
            return None
    return extended

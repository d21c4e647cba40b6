"""Deciding conditions as far as facts that nothing ever changes do."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from itertools import product

from nondum.planning.ground.instances import Row
from nondum.planning.ground.join import Work
from nondum.planning.ground.members import domains_of
from nondum.planning.pddl.syntax import (
    And,
    Atom,
    Equal,
    Formula,
    Not,
    Or,
    Quantified,
    Term,
)
from nondum.sdk.frozen import frozen

_WORK_OF_BINDING = 3
"""What looking at one binding of a quantifier counts as."""
Names = Mapping[str, str]
"""Variable → object."""


@frozen
class StaticFacts:
    """The facts that no action and no rule writes."""

    rows: Mapping[str, frozenset[Row]]
    """Predicate → its facts."""
    written: frozenset[str]
    """The predicates that something writes: of these it knows nothing."""
    members: Mapping[str, frozenset[str]]
    """Type → the objects of it."""
    work: Work
    """What deciding quantifiers may take."""

    def may_hold(self, formula: Formula, names: Names) -> bool:
        """Whether a normal condition can hold, for all that static facts say.

        Raises `TooMuchWork`.
        """
        match formula:
            case Atom():
                return formula.predicate in self.written or self._holds(formula, names)
            case Not(part=Atom() as atom):
                return atom.predicate in self.written or not self._holds(atom, names)
            case Equal():
                return value_of(formula.left, names) == value_of(formula.right, names)
            case Not(part=Equal() as pair):
                return value_of(pair.left, names) != value_of(pair.right, names)
            case And():
                return all(self.may_hold(part, names) for part in formula.parts)
            case Or():
                return any(self.may_hold(part, names) for part in formula.parts)
            case Quantified(quantifier="forall"):
                return all(self.may_hold(formula.part, n) for n in self._bindings(formula, names))
            case Quantified():
                return any(self.may_hold(formula.part, n) for n in self._bindings(formula, names))
        raise AssertionError(f"not in normal form: {formula}")

    def _holds(self, atom: Atom, names: Names) -> bool:
        row = tuple(value_of(term, names) for term in atom.terms)
        return row in self.rows.get(atom.predicate, ())

    def _bindings(self, formula: Quantified, names: Names) -> Iterator[Names]:
        domains = domains_of(formula.variables, self.members)
        for values in product(*map(sorted, domains.values())):
            self.work.spend(_WORK_OF_BINDING)
            yield {**names, **dict(zip(domains, values, strict=True))}


def static_facts(
    believed: Iterable[tuple[str, Row]],
    written: frozenset[str],
    members: Mapping[str, frozenset[str]],
    work: Work,
) -> StaticFacts:
    """Those of the believed facts that nothing writes."""
    rows: defaultdict[str, set[Row]] = defaultdict(set)
    for predicate, row in believed:
        if predicate not in written:
            rows[predicate].add(row)
    found = {name: frozenset(those) for name, those in rows.items()}
    return StaticFacts(found, written, members, work)


def value_of(term: Term, names: Names) -> str:
    """The object that a term stands for."""
    return names.get(term.name, term.name)

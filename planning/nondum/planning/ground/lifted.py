"""What schemas mean in a state, without grounding: conditions, rules and effects as written.

Slow where grounding is quick, and made of other parts: one is checked against the other.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product

from nondum.planning.ground.instances import Row
from nondum.planning.ground.members import domains_of, members_of
from nondum.planning.ground.static import Names, value_of
from nondum.planning.merge.derivation import strata_of
from nondum.planning.merge.domain import Action, Merged
from nondum.planning.pddl.facts import parts
from nondum.planning.pddl.normal import Condition, condition_of, normal
from nondum.planning.pddl.syntax import And, Atom, Equal, Formula, Not, Or, Quantified, TypedName
from nondum.sdk.frozen import frozen

State = frozenset[tuple[str, Row]]
"""The facts that hold, those that rules derive left out."""


@frozen
class Situation:
    """A state in which conditions can be asked for. Make it with `Meaning.situation`."""

    state: State
    rows: Mapping[str, set[Row]]
    """Predicate → its facts, derived ones included."""
    members: Mapping[str, frozenset[str]]
    """Type → the objects of it."""

    def holds(self, formula: Formula, names: Names) -> bool:
        """Whether a normal condition is true for a binding of its free variables."""
        match formula:
            case Atom():
                return self._row(formula, names) in self.rows.get(formula.predicate, ())
            case Not():
                return not self.holds(formula.part, names)
            case Equal():
                return value_of(formula.left, names) == value_of(formula.right, names)
            case And():
                return all(self.holds(part, names) for part in formula.parts)
            case Or():
                return any(self.holds(part, names) for part in formula.parts)
            case Quantified(quantifier="exists"):
                found = self.bindings(formula.variables, condition_of(formula.part), names)
                return any(True for _ in found)
            case Quantified():
                against = condition_of(normal(formula.part, negated=True))
                return not any(True for _ in self.bindings(formula.variables, against, names))
        raise AssertionError(f"not in normal form: {formula}")

    def missing(self, condition: Condition, names: Names) -> tuple[Formula, ...]:
        """The parts of a condition that do not hold."""
        return tuple(part for part in condition.parts() if not self.holds(part, names))

    def bindings(
        self, variables: Sequence[TypedName], condition: Condition, names: Names
    ) -> Iterator[Names]:
        """The bindings of more variables for which a condition holds, besides `names`."""
        own = {variable.name for variable in variables}
        outer = {name: value for name, value in names.items() if name not in own}
        domains = domains_of(variables, self.members)
        checks = tuple(part for part in condition.parts() if not isinstance(part, Atom))
        for found in self._matches(list(condition.positive), domains, outer):
            free = sorted(own - found.keys())
            for values in product(*(sorted(domains[name]) for name in free)):
                binding = {**found, **dict(zip(free, values, strict=True))}
                if all(self.holds(check, binding) for check in checks):
                    yield binding

    def _matches(
        self, atoms: Sequence[Atom], domains: Mapping[str, frozenset[str]], names: Names
    ) -> Iterator[Names]:
        """The bindings for which all atoms are facts."""
        if not atoms:
            yield names
            return
        atom = min(atoms, key=lambda atom: _unbound(atom, domains, names))
        left = [other for other in atoms if other is not atom]
        if not _unbound(atom, domains, names):
            if self.holds(atom, names):
                yield from self._matches(left, domains, names)
            return
        for row in sorted(self.rows.get(atom.predicate, ())):
            if (found := _matched(atom, row, domains, names)) is not None:
                yield from self._matches(left, domains, found)

    def _row(self, atom: Atom, names: Names) -> Row:
        return tuple(value_of(term, names) for term in atom.terms)


def _unbound(atom: Atom, domains: Mapping[str, frozenset[str]], names: Names) -> int:
    return sum(term.name in domains and term.name not in names for term in atom.terms)


def _matched(
    atom: Atom, row: Row, domains: Mapping[str, frozenset[str]], names: Names
) -> Names | None:
    found = dict(names)
    for term, value in zip(atom.terms, row, strict=True):
        known = found.get(term.name, None if term.name in domains else term.name)
        if known is None and value in domains[term.name]:
            found[term.name] = value
        elif known != value:
            return None
    return found


@dataclass(slots=True)
class Meaning:
    """A domain and the objects there are."""

    merged: Merged
    objects: Mapping[str, tuple[str, ...]]
    """Object → its types."""
    members: Mapping[str, frozenset[str]] = field(init=False)
    _strata: tuple[tuple[str, ...], ...] = field(init=False)

    def __post_init__(self) -> None:
        self.members = members_of(self.merged, self.objects)
        self._strata = strata_of(self.merged.domain.derived).groups

    def start(self, facts: Iterable[str]) -> State:
        """The state in which these facts hold, those about what is not there left out."""
        derived = {rule.head.predicate for rule in self.merged.domain.derived}
        split = map(parts, facts)
        return frozenset(
            (predicate, row)
            for predicate, row in split
            if predicate not in derived and all(name in self.objects for name in row)
        )

    def situation(self, state: State) -> Situation:
        """A state with all that follows from it (PDDL 2.2: stratum by stratum)."""
        rows: defaultdict[str, set[Row]] = defaultdict(set)
        for predicate, row in state:
            rows[predicate].add(row)
        situation = Situation(state, rows, self.members)
        for group in self._strata:
            rules = [r for r in self.merged.domain.derived if r.head.predicate in group]
            is_settled = False
            while not is_settled:
                new = {
                    (rule.head.predicate, tuple(binding[t.name] for t in rule.head.terms))
                    for rule in rules
                    for binding in situation.bindings(rule.parameters, rule.condition, {})
                }
                is_settled = all(row in rows[predicate] for predicate, row in new)
                for predicate, row in new:
                    rows[predicate].add(row)
        return situation

    def after(self, situation: Situation, action: Action, names: Names) -> State:
        """The state that an action makes of a situation; what it also adds, it does not delete."""
        added = {_fact(atom, names) for atom in action.effect.add}
        deleted = {_fact(atom, names) for atom in action.effect.delete}
        for change in action.effect.conditional:
            for binding in situation.bindings(change.variables, change.condition, names):
                added |= {_fact(atom, binding) for atom in change.add}
                deleted |= {_fact(atom, binding) for atom in change.delete}
        return (situation.state - deleted) | added


def _fact(atom: Atom, names: Names) -> tuple[str, Row]:
    return atom.predicate, tuple(value_of(term, names) for term in atom.terms)

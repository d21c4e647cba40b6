"""Conditions over the objects there are now: quantifiers written out, disjunctions split.

What unchanging facts decide is decided first, so that little is left to split.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

from nondum.planning.ground.instances import Exploration, Literals, Row
from nondum.planning.ground.join import Domains, Join, Query, Relations, Values, Work
from nondum.planning.ground.matching import Pattern
from nondum.planning.ground.members import domains_of
from nondum.planning.ground.static import Names, value_of
from nondum.planning.pddl.normal import condition_of, normal
from nondum.planning.pddl.syntax import (
    And,
    Atom,
    Equal,
    Formula,
    Not,
    Or,
    Quantified,
    TypedName,
    renamed,
)
from nondum.sdk.frozen import frozen
from nondum.sdk.planner import Rule

DISJUNCTS_LIMIT = 12
"""A condition with more is given a derived fact that stands for it."""
_WORK_OF_BINDING = 10
"""What writing out one binding of a quantifier counts as."""


@frozen
class Both:
    """All parts hold; none: it is true."""

    parts: tuple[Tree, ...]


@frozen
class Either:
    """Some part holds; none: it is false."""

    parts: tuple[Tree, ...]


Tree: TypeAlias = Literals | Both | Either

TRUE, FALSE = Literals(), Either(())


@dataclass(slots=True)
class Expander:
    """Expands conditions over one explored domain."""

    found: Exploration
    is_closed: bool
    """What is true and cannot change need not be guarded."""
    work: Work
    """What writing out quantifiers may take."""
    _rules: list[Rule] = field(default_factory=list)
    _made: int = 0
    _relations: Relations = field(default_factory=Relations)
    _joins: dict[tuple[Quantified, Row], tuple[Join, Quantified, Domains]] = field(
        default_factory=dict
    )
    _lasting: frozenset[int] = frozenset()

    def __post_init__(self) -> None:
        for number in sorted(self.found.reached):
            self._relations.add(*self.found.table.facts[number])
        deleted: set[int] = set()
        for instance in self.found.instances:
            deleted |= instance.delete
            for change in instance.changes:
                deleted |= change.delete
        self._lasting = self.found.believed - deleted

    def alternatives(
        self, literals: Literals, further: Sequence[Formula], names: Names
    ) -> tuple[Literals, ...]:
        """The ways in which all this can hold; none: it never does. Raises `TooMuchWork`."""
        plain = self._plain(literals)
        if plain is None:
            return ()
        if not further:
            return (plain,)
        tree = _both((plain, *(self._tree(part, names) for part in further)))
        split = _split(tree)
        if split is None:
            place = further[0].place
            split = _split(self._small(tree, f"or@{place.line}:{place.column}")) or ()
        return split

    def _plain(self, literals: Literals) -> Literals | None:
        """The literals that something may make false; None if one never holds."""
        reached, lasting = self.found.reached, self._lasting
        others = literals - reached
        if not others:
            return literals - lasting if self.is_closed else literals
        if any(literal >= 0 or ~literal in lasting for literal in others):
            return None
        if not self.is_closed:
            return literals
        return literals - others - lasting | {n for n in others if ~n in reached}

    def _literal(self, atom: Atom, names: Names, *, is_true: bool) -> Tree:
        row = tuple(value_of(term, names) for term in atom.terms)
        number = self.found.table.number(atom.predicate, row)
        plain = self._plain(frozenset((number if is_true else ~number,)))
        return FALSE if plain is None else plain

    def _tree(self, formula: Formula, names: Names) -> Tree:
        match formula:
            case Atom():
                return self._literal(formula, names, is_true=True)
            case Not(part=Atom() as atom):
                return self._literal(atom, names, is_true=False)
            case Equal():
                alike = value_of(formula.left, names) == value_of(formula.right, names)
                return TRUE if alike else FALSE
            case Not(part=Equal() as pair):
                alike = value_of(pair.left, names) == value_of(pair.right, names)
                return FALSE if alike else TRUE
            case And():
                return _both(self._tree(part, names) for part in formula.parts)
            case Or():
                return _either(self._tree(part, names) for part in formula.parts)
            case Quantified(quantifier="forall"):
                return _both(self._tree(part, n) for part, n in self._bindings(formula, names))
            case Quantified():
                return _either(self._tree(part, n) for part, n in self._bindings(formula, names))
        raise AssertionError(f"not in normal form: {formula}")

    def _bindings(self, formula: Quantified, names: Names) -> Iterator[tuple[Formula, Names]]:
        """The bindings that matter: those that can make `exists` true, or `forall` false."""
        key = (formula, tuple(names))
        if key not in self._joins:
            self._joins[key] = self._join(formula, tuple(names))
        join, apart, domains = self._joins[key]
        found: list[Row] = []
        size = len(names) + len(apart.variables)

        def fire(values: Values) -> None:
            self.work.spend(_WORK_OF_BINDING)
            found.append(tuple(values[:size]))

        join.run(self._relations, domains, fire, known=tuple(names.values()), work=self.work)
        variables = (*names, *(variable.name for variable in apart.variables))
        for row in sorted(set(found)):
            yield apart.part, dict(zip(variables, row, strict=True))

    def _join(self, formula: Quantified, names: Row) -> tuple[Join, Quantified, Domains]:
        fresh = {v.name: f"{v.name}~{len(names)}" for v in formula.variables if v.name in names}
        variables = tuple(
            TypedName(fresh.get(v.name, v.name), v.types, v.place) for v in formula.variables
        )
        part = renamed(formula.part, fresh)
        deciding = normal(part, negated=formula.quantifier == "forall")
        condition = condition_of(deciding)
        own = {variable.name for variable in variables}
        # In an open world, what nothing here makes true may still come true, and must be guarded.
        is_selective = self.is_closed or formula.quantifier == "exists"
        domains = domains_of(variables, self.found.members)
        known = dict.fromkeys(names, frozenset[str]())
        query = Query(
            variables=(*names, *(variable.name for variable in variables)),
            breadths={name: len(domain) for name, domain in {**known, **domains}.items()},
            patterns=tuple(
                Pattern.of(atom)
                for atom in condition.positive
                if own & {term.name for term in atom.terms}
            )
            if is_selective
            else (),
        )
        apart = Quantified(formula.quantifier, variables, part, formula.place)
        of_all = (*known.values(), *(domains[variable.name] for variable in variables))
        return Join(query, known=names), apart, of_all

    def _small(self, tree: Tree, name: str) -> Tree:
        """The tree with every disjunction replaced by a fact that stands for it."""
        match tree:
            case Both():
                return _both(self._small(part, name) for part in tree.parts)
            case Either(parts) if parts:
                bodies: list[Literals] = []
                for part in parts:
                    bodies += _split(self._small(part, name)) or ()
                return self._stand_in(tuple(dict.fromkeys(bodies)), name)
        return tree

    def disjunction(self, alternatives: Sequence[Literals], name: str) -> Literals:
        """One conjunction that holds where one of several does."""
        return alternatives[0] if len(alternatives) == 1 else self._stand_in(alternatives, name)

    def _stand_in(self, bodies: Sequence[Literals], name: str) -> Literals:
        """A new fact that holds where one of `bodies` does."""
        fact = self.found.table.number(name, (str(self._made),))
        self._made += 1
        self._rules += (Rule(fact, body) for body in bodies)
        return frozenset((fact,))

    def new_rules(self) -> tuple[Rule, ...]:
        """The rules of the derived facts that had to be made since last time."""
        rules, self._rules = tuple(self._rules), []
        return rules


def is_possible(literals: Literals) -> bool:
    """Whether a conjunction does not contradict itself."""
    return not any(~literal in literals for literal in literals)


def _both(parts: Iterable[Tree]) -> Tree:
    plain = Literals()
    others: list[Tree] = []
    for part in parts:
        match part:
            case frozenset():
                plain |= part
            case Both():
                for inner in part.parts:
                    if isinstance(inner, frozenset):
                        plain |= inner
                    else:
                        others.append(inner)
            case Either(()):
                return FALSE
            case Either():
                others.append(part)
    if not is_possible(plain):
        return FALSE
    return Both((plain, *others)) if others else plain


def _either(parts: Iterable[Tree]) -> Tree:
    found: list[Tree] = []
    for part in parts:
        if part == TRUE:
            return TRUE
        found += part.parts if isinstance(part, Either) else (part,)
    distinct = tuple(dict.fromkeys(found))
    return distinct[0] if len(distinct) == 1 else Either(distinct)


def _split(tree: Tree) -> tuple[Literals, ...] | None:
    """The tree as a disjunction of conjunctions; None if there are too many of them."""
    match tree:
        case frozenset():
            return (tree,)
        case Either(parts):
            found: list[Literals] = []
            for part in parts:
                split = _split(part)
                if split is None or len(found) + len(split) > DISJUNCTS_LIMIT:
                    return None
                found += split
            return _least(found)
        case Both(parts):
            products = [Literals()]
            for part in parts:
                split = _split(part)
                if split is None or len(products) * len(split) > DISJUNCTS_LIMIT:
                    return None
                products = [one | other for one in products for other in split]
            return _least(filter(is_possible, products))


def _least(conjunctions: Iterable[Literals]) -> tuple[Literals, ...]:
    """Without those that another one follows from."""
    distinct = list(dict.fromkeys(conjunctions))
    return tuple(
        one for one in distinct if not any(other != one and other <= one for other in distinct)
    )

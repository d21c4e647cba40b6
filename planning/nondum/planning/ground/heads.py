"""Rules of the join, and what happens when their conditions are met."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping
from functools import lru_cache
from operator import itemgetter
from typing import TYPE_CHECKING, Generic, TypeVar

from nondum.planning.ground.instances import Change, Derivation, FactTable, Instance, Literals, Row
from nondum.planning.ground.join import Domains, Join, Query, Values
from nondum.planning.ground.matching import Pattern
from nondum.planning.merge.domain import Action, DerivedRule, Origin
from nondum.planning.merge.effect import ConditionalChange
from nondum.planning.pddl.flat import Flat, flat
from nondum.planning.pddl.normal import Condition
from nondum.planning.pddl.syntax import Atom, TypedName

if TYPE_CHECKING:
    from nondum.planning.ground.exploration import Fixpoint

_T = TypeVar("_T")

_KEPT = 8192
"""Conditions whose joins are kept, so that one more component costs its own only."""
_WORK_OF_DECIDING = 10
"""What deciding a disjunction or quantifier counts as."""
_WORK_OF_BINDING = 5
"""The same of a binding that no action or rule needs."""


class _Template:
    """Atoms that become facts when a rule's variables have values."""

    def __init__(self, atoms: Iterable[Atom], variables: Row, table: FactTable) -> None:
        at = {name: index for index, name in enumerate(variables)}
        self._atoms = tuple(
            (atom.predicate, _row_of(atom, at), table.of(atom.predicate)) for atom in atoms
        )
        self._table = table

    def numbers(self, values: Values) -> frozenset[int]:
        """The facts."""
        found = []
        for predicate, row_of, known in self._atoms:
            row = row_of(values)
            number = known.get(row)
            found.append(self._table.number(predicate, row) if number is None else number)
        return frozenset(found)


def _row_of(atom: Atom, at: Mapping[str, int]) -> Callable[[Values], Row]:
    """What makes an atom's row of a rule's values; the usual kinds of it quickly."""
    terms = tuple((at.get(term.name, -1), term.name) for term in atom.terms)
    if all(index >= 0 for index, _ in terms):
        if len(terms) > 1:
            return itemgetter(*(index for index, _ in terms))
        if terms:
            only = terms[0][0]
            return lambda values: (values[only],)
    return lambda values: tuple([values[i] if i >= 0 else name for i, name in terms])


class Head(ABC):
    """A rule of the join, and what happens when it fires."""

    def __init__(
        self,
        found: Flat,
        own: Condition,
        name: str,
        origins: tuple[Origin, ...],
        fixpoint: Fixpoint,
    ) -> None:
        """`own` is the part of the condition that is recorded."""
        self.name = name
        self.origins = origins
        self._flat = found
        self._fixpoint = fixpoint
        self.variables = tuple(variable.name for variable in found.variables)
        domains = fixpoint.domains_of(found.variables)
        self.domains = tuple(domains[name] for name in self.variables)
        """The objects of each variable."""
        self._negative = self.template(found.negative)
        self._own = self.template(own.positive)
        self._own_negative = self.template(own.negative) if own.negative else None

    @property
    def is_bound(self) -> bool:
        """Whether there is nothing to bind, nor to compare."""
        return not (self.variables or self._flat.equal or self._flat.unequal)

    @property
    def needs(self) -> frozenset[int]:
        """The facts that it waits for, where it is bound."""
        return self.template(self._flat.positive).numbers([])

    @property
    def joins(self) -> tuple[tuple[str, Join], ...]:
        """What finds its bindings, each with the predicate that triggers it."""
        return joins_of(self._flat, self.domains, self._fixpoint.added)

    def template(self, atoms: Iterable[Atom]) -> _Template:
        """What atoms become when the rule fires."""
        return _Template(atoms, self.variables, self._fixpoint.table)

    def is_excluded(self, values: Values) -> bool:
        """Whether something keeps a binding from ever being possible."""
        if self._flat.negative and self._fixpoint.excludes(self._negative.numbers(values)):
            return True
        if not self._flat.rest:
            return False
        self._fixpoint.work.spend(_WORK_OF_DECIDING)
        names = self.names(values)
        return not all(self._fixpoint.static.may_hold(part, names) for part in self._flat.rest)

    def literals(self, values: Values) -> Literals:
        """Those of the recorded condition."""
        positive = self._own.numbers(values)
        if self._own_negative is None:
            return positive
        return positive | {~number for number in self._own_negative.numbers(values)}

    def names(self, values: Values) -> dict[str, str]:
        """Variable → object."""
        return dict(zip(self.variables, values, strict=False))

    @abstractmethod
    def fire(self, values: Values) -> None:
        """Record one binding."""


class ActionHead(Head):
    def __init__(self, action: Action, fixpoint: Fixpoint) -> None:
        found = flattened(action.parameters, action.precondition)
        super().__init__(found, action.precondition, action.name, action.origins, fixpoint)
        self._action = action
        self._arity = len(action.parameters)
        self._add = self.template(action.effect.add)
        self._delete = self.template(action.effect.delete)
        self._changes = bool(action.effect.conditional)

    def fire(self, values: Values) -> None:
        row = tuple(values[: self._arity])
        key = (self._action.name, row)
        if key in self._fixpoint.instances or self.is_excluded(values):
            return
        add = self._add.numbers(values)
        delete = self._delete.numbers(values) - add
        if not (self._changes or self._fixpoint.asks_for(add, delete)):
            self._fixpoint.work.spend(_WORK_OF_BINDING)
            return
        self._fixpoint.instances[key] = Instance(
            action=self._action,
            row=row,
            literals=self.literals(values),
            add=add,
            delete=delete,
        )
        self._fixpoint.count(self)
        self._fixpoint.reach(add)


class ChangeHead(Head):
    def __init__(self, action: Action, change: ConditionalChange, fixpoint: Fixpoint) -> None:
        variables = (*action.parameters, *change.variables)
        found = flattened(variables, action.precondition, change.condition)
        super().__init__(found, change.condition, action.name, action.origins, fixpoint)
        self._action = action
        self._change = change
        self._arity = len(action.parameters)
        self._size = len(variables)
        self._add = self.template(change.add)
        self._delete = self.template(change.delete)
        self._seen: set[Row] = set()

    def fire(self, values: Values) -> None:
        row = tuple(values[: self._size])
        instance = self._fixpoint.instances.get((self._action.name, row[: self._arity]))
        if instance is None or row in self._seen or self.is_excluded(values):
            return
        self._seen.add(row)
        add = self._add.numbers(values)
        change = Change(
            condition=self._change.condition,
            names=self.names(values),
            literals=self.literals(values),
            add=add,
            delete=self._delete.numbers(values) - add,
        )
        instance.changes.append(change)
        self._fixpoint.count(self)
        self._fixpoint.reach(add)


class DerivedHead(Head):
    def __init__(self, derived: DerivedRule, fixpoint: Fixpoint) -> None:
        found = flattened(derived.parameters, derived.condition)
        name = derived.head.predicate
        super().__init__(found, derived.condition, name, derived.origins, fixpoint)
        self._derived = derived
        self._arity = len(derived.parameters)
        self._head = self.template((derived.head,))
        self._seen: set[Row] = set()

    def fire(self, values: Values) -> None:
        row = tuple(values[: self._arity])
        if row in self._seen or self.is_excluded(values):
            return
        self._seen.add(row)
        head = self._head.numbers(values)
        derivation = Derivation(
            rule=self._derived,
            names=self.names(values),
            head=next(iter(head)),
            literals=self.literals(values),
        )
        self._fixpoint.derivations.append(derivation)
        self._fixpoint.count(self)
        self._fixpoint.reach(head)


class _Same(Generic[_T]):
    """Something that is equal to itself only; saves comparing conditions part by part."""

    __slots__ = ("value",)

    def __init__(self, value: _T) -> None:
        self.value = value

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Same) and self.value is other.value

    def __hash__(self) -> int:
        return id(self.value)


def flattened(variables: tuple[TypedName, ...], *conditions: Condition) -> Flat:
    """`flat`, done once for the same conditions."""
    return _flattened(variables, *map(_Same, conditions))


@lru_cache(maxsize=_KEPT)
def _flattened(variables: tuple[TypedName, ...], *conditions: _Same[Condition]) -> Flat:
    return flat(variables, *(condition.value for condition in conditions))


def joins_of(
    found: Flat, domains: Domains, growing: frozenset[str]
) -> tuple[tuple[str, Join], ...]:
    """The joins of a condition, each with the predicate that triggers it; empty: it runs once.

    `domains` are the objects of each variable: how many there are when a condition is first met
    decides in which order it is joined. Facts of predicates that are not in `growing` are all there
    from the beginning.
    """
    at = tuple(i for i, atom in enumerate(found.positive) if atom.predicate in growing)
    key = (_Same(found), at)
    if key not in _prepared:
        if len(_prepared) == _KEPT:
            _prepared.clear()
        _prepared[key] = _joins(found, domains, at)
    return _prepared[key]


_prepared: dict[tuple[_Same[Flat], tuple[int, ...]], tuple[tuple[str, Join], ...]] = {}


def _joins(found: Flat, domains: Domains, growing: tuple[int, ...]) -> tuple[tuple[str, Join], ...]:
    names = tuple(variable.name for variable in found.variables)
    query = Query(
        variables=names,
        breadths={name: len(domain) for name, domain in zip(names, domains, strict=True)},
        patterns=tuple(map(Pattern.of, found.positive)),
        equal=tuple((pair.left.name, pair.right.name) for pair in found.equal),
        unequal=tuple((pair.left.name, pair.right.name) for pair in found.unequal),
    )
    if not growing:
        return (("", Join(query)),)
    return tuple((found.positive[index].predicate, Join(query, index)) for index in growing)

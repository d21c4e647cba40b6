"""What can ever become true, and by which bindings of which actions, if nothing were deleted."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from operator import itemgetter

from nondum.planning.concern import Wishes
from nondum.planning.domain import (
    Action,
    DerivedRule,
    Merged,
    Origin,
    functional_predicates,
)
from nondum.planning.effect import ConditionalChange
from nondum.planning.facts import parts
from nondum.planning.flat import Flat
from nondum.planning.join import Join, TooMuchWork, Values, Work
from nondum.planning.matching import Pattern
from nondum.planning.normal import Condition
from nondum.planning.preparation import flattened, joins_of
from nondum.planning.relations import FactTable, Relations, Row
from nondum.planning.static import static_facts
from nondum.planning.syntax import Atom, TypedName
from nondum.planning.typegraph import ROOT
from nondum.sdk.errors import FragmentRefused, Problem

INSTANCES_LIMIT = 100_000
"""Ground actions that a domain may have."""

_WORK_PER_INSTANCE = 50
"""Objects and facts that may be looked at in vain, for each ground action that there may be."""
_WORK_OF_DECIDING = 10
"""What deciding a disjunction or quantifier counts as."""

Types = Mapping[str, tuple[str, ...]]
"""Object → its types."""


class TooManyBindings(FragmentRefused):
    """A domain that is too big to be written out. `components` brought what is widest in it."""

    def __init__(self, problem: Problem, components: frozenset[str]) -> None:
        super().__init__(problem)
        self.components = components

    @classmethod
    def of(cls, message: str, origins: Sequence[Origin], *, fix: str) -> TooManyBindings:
        """PDDL_TOO_MANY, with the places that it is about."""
        problem = Problem("PDDL_TOO_MANY", message, " and ".join(map(str, origins)), fix=fix)
        return cls(problem, frozenset(origin.component for origin in origins))


def work_for(limit: int) -> Work:
    """What may be looked at where so many bindings may be made."""
    return Work(_WORK_PER_INSTANCE * limit)


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


def explore(
    merged: Merged,
    facts: Iterable[str],
    objects: Types | None = None,
    *,
    limit: int = INSTANCES_LIMIT,
    wishes: Wishes | None = None,
) -> Exploration:
    """Explore from where exactly `facts` hold; `objects` exist beside the merged ones.

    A condition that something is false counts as reachable, unless it is true and nothing can ever
    make it false; disjunctions and quantifiers are decided as far as facts that never change do.
    Raises `TooManyBindings` (PDDL_TOO_MANY) that names the action with most bindings when there are
    more than `limit`, or too many are looked at: to leave some out would make a wrong proof.
    """
    types = {name: found.types for name, found in merged.objects.items()} | dict(objects or {})
    members = members_of(merged, types)
    derived = {rule.head.predicate for rule in merged.domain.derived}
    believed = [parts(text) for text in sorted(facts)]
    known = [
        (predicate, row)
        for predicate, row in believed
        if predicate not in derived and all(name in types for name in row)
    ]
    return _Fixpoint(merged, known, members, limit, wishes).run()


def members_of(merged: Merged, types: Types) -> dict[str, frozenset[str]]:
    """Type → the objects of it; `types` are the types of every object."""
    members: defaultdict[str, set[str]] = defaultdict(set)
    above: dict[str, frozenset[str]] = {}
    for name, of in types.items():
        for type_ in of:
            if type_ not in above:
                above[type_] = frozenset(merged.domain.types.ancestors(type_))
            for ancestor in above[type_]:
                members[ancestor].add(name)
    return {type_: frozenset(names) for type_, names in members.items()}


def domains_of(
    variables: Iterable[TypedName], members: Mapping[str, frozenset[str]]
) -> dict[str, frozenset[str]]:
    """Variable → the objects that it may stand for."""
    return {
        variable.name: frozenset().union(
            *(members.get(type_, ()) for type_ in variable.types or (ROOT,))
        )
        for variable in variables
    }


def patterns_of(condition: Condition) -> tuple[Pattern, ...]:
    """The conditions that facts must match."""
    return tuple(map(Pattern.of, condition.positive))


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
    if len(terms) > 1 and all(index >= 0 for index, _ in terms):
        return itemgetter(*(index for index, _ in terms))
    return lambda values: tuple([values[i] if i >= 0 else name for i, name in terms])


class _Head:
    """A rule of the join, and what happens when it fires."""

    def __init__(
        self, found: Flat, name: str, origins: tuple[Origin, ...], fixpoint: _Fixpoint
    ) -> None:
        self.name = name
        self.origins = origins
        self._flat = found
        self._fixpoint = fixpoint
        self.variables = tuple(variable.name for variable in found.variables)
        domains = fixpoint.domains_of(found.variables)
        self.domains = tuple(domains[name] for name in self.variables)
        """The objects of each variable."""
        self._negative = self.template(found.negative)

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

    def names(self, values: Values) -> dict[str, str]:
        """Variable → object."""
        return dict(zip(self.variables, values, strict=False))

    def fire(self, values: Values) -> None:
        """Record one binding."""
        raise NotImplementedError


class _ActionHead(_Head):
    def __init__(self, action: Action, fixpoint: _Fixpoint) -> None:
        found = flattened(action.parameters, action.precondition)
        super().__init__(found, action.name, action.origins, fixpoint)
        self._action = action
        self._arity = len(action.parameters)
        self._positive = self.template(action.precondition.positive)
        self._negative_own = self.template(action.precondition.negative)
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
            return
        self._fixpoint.instances[key] = Instance(
            action=self._action,
            row=row,
            positive=self._positive.numbers(values),
            negative=self._negative_own.numbers(values),
            add=add,
            delete=delete,
        )
        self._fixpoint.count(self)
        self._fixpoint.reach(add)


class _ChangeHead(_Head):
    def __init__(self, action: Action, change: ConditionalChange, fixpoint: _Fixpoint) -> None:
        variables = (*action.parameters, *change.variables)
        found = flattened(variables, action.precondition, change.condition)
        super().__init__(found, action.name, action.origins, fixpoint)
        self._action = action
        self._change = change
        self._arity = len(action.parameters)
        self._size = len(variables)
        self._positive = self.template(change.condition.positive)
        self._negative_own = self.template(change.condition.negative)
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
            positive=self._positive.numbers(values),
            negative=self._negative_own.numbers(values),
            add=add,
            delete=self._delete.numbers(values) - add,
        )
        instance.changes.append(change)
        self._fixpoint.count(self)
        self._fixpoint.reach(add)


class _DerivedHead(_Head):
    def __init__(self, derived: DerivedRule, fixpoint: _Fixpoint) -> None:
        found = flattened(derived.parameters, derived.condition)
        super().__init__(found, derived.head.predicate, derived.origins, fixpoint)
        self._derived = derived
        self._arity = len(derived.parameters)
        self._positive = self.template(derived.condition.positive)
        self._negative_own = self.template(derived.condition.negative)
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
            positive=self._positive.numbers(values),
            negative=self._negative_own.numbers(values),
        )
        self._fixpoint.derivations.append(derivation)
        self._fixpoint.count(self)
        self._fixpoint.reach(head)


class _Fixpoint:
    """Facts wait in line; each one taken out fires every rule that it completes."""

    def __init__(
        self,
        merged: Merged,
        believed: Iterable[tuple[str, Row]],
        members: Mapping[str, frozenset[str]],
        limit: int,
        wishes: Wishes | None,
    ) -> None:
        self._wishes = wishes
        self._domain = merged.domain
        self._members = members
        self._limit = limit
        self.work = work_for(limit)
        self._spent: Counter[_Head] = Counter()
        self._counts: Counter[_Head] = Counter()
        self._total = 0
        self.table = FactTable()
        self._believed = frozenset(self.table.number(*fact) for fact in believed)
        self._reached = set(self._believed)
        self._waiting: list[int] = []
        effects = [action.effect for action in merged.domain.actions.values()]
        derived = {rule.head.predicate for rule in merged.domain.derived}
        added = {atom.predicate for effect in effects for atom in effect.added()}
        deleted = {atom.predicate for effect in effects for atom in effect.deleted()}
        self._functional = functional_predicates(merged.domain)
        self._deleted = deleted | (added & self._functional)
        self.added = frozenset(added | derived)
        self.static = static_facts(
            map(self.table.facts.__getitem__, self._believed),
            frozenset(self.added | self._deleted),
            members,
            self.work,
        )
        self.instances: dict[tuple[str, Row], Instance] = {}
        self.derivations: list[Derivation] = []

    def domains_of(self, variables: Iterable[TypedName]) -> dict[str, frozenset[str]]:
        """Variable → the objects that it may stand for."""
        return domains_of(variables, self._members)

    def excludes(self, negative: frozenset[int]) -> bool:
        """Whether a fact that must be false is true, and stays so."""
        facts = self.table.facts
        return any(facts[n][0] not in self._deleted for n in negative & self._believed)

    def asks_for(self, add: frozenset[int], delete: frozenset[int]) -> bool:
        """Whether anybody wishes for one of these changes."""
        wishes = self._wishes
        if wishes is None:
            return True
        facts = self.table.facts
        return (
            any(wishes.include(*facts[n], is_true=True) for n in add)
            or any(wishes.include(*facts[n], is_true=False) for n in delete)
            or any(facts[n][0] in self._functional for n in add)
        )

    def reach(self, facts: frozenset[int]) -> None:
        """Put the facts that are new in line."""
        new = facts - self._reached
        self._reached |= new
        self._waiting += sorted(new)

    def count(self, head: _Head) -> None:
        """Count a binding. Raises `TooManyBindings` where there are too many."""
        self._counts[head] += 1
        self._total += 1
        if self._total > self._limit:
            raise self._too_many()

    def run(self) -> Exploration:
        joins = [(join, trigger, head) for head in self._heads() for trigger, join in head.joins]
        relations = Relations()
        triggered: defaultdict[str, list[tuple[Join, _Head]]] = defaultdict(list)
        for join, trigger, head in joins:
            if trigger:
                triggered[trigger].append((join, head))
        for number in sorted(self._believed):
            predicate, row = self.table.facts[number]
            if predicate in self.added:
                self._waiting.append(number)
            else:
                relations.add(predicate, row)
        for join, trigger, head in joins:
            if not trigger:
                self._join(join, head, relations)
        while self._waiting:
            predicate, row = self.table.facts[self._waiting.pop()]
            relations.add(predicate, row)
            for join, head in triggered.get(predicate, ()):
                self._join(join, head, relations, row)
        return Exploration(
            self.table,
            self._believed,
            frozenset(self._reached),
            tuple(sorted(self.instances.values(), key=lambda i: (i.action.name, i.row))),
            tuple(self.derivations),
            self._members,
        )

    def _heads(self) -> Iterator[_Head]:
        """Each action before its changes, so that these find the instance that they belong to."""
        for action in self._domain.actions.values():
            yield _ActionHead(action, self)
            for change in action.effect.conditional:
                yield _ChangeHead(action, change, self)
        for rule in self._domain.derived:
            yield _DerivedHead(rule, self)

    def _join(self, join: Join, head: _Head, relations: Relations, row: Row = ()) -> None:
        before = self.work.left
        try:
            join.run(relations, head.domains, head.fire, row, work=self.work)
        except TooMuchWork:
            self._spent[head] += before
            raise self._too_many() from None
        self._spent[head] += before - self.work.left

    def _too_many(self) -> TooManyBindings:
        """Those count who made most bindings or, where none were made, looked at most."""
        is_fruitless = self.work.left < 0
        counts = _by_name(self._spent if is_fruitless else self._counts)
        name, (count, origins) = max(
            counts.items(), key=lambda counted: (counted[1][0], counted[0])
        )
        message = (
            f"the ways to bind {name!r} are too many to look at"
            if is_fruitless
            else f"more than {self._limit} ways to bind the actions, {count} of them of {name!r}"
        )
        return TooManyBindings.of(
            message, origins, fix="add preconditions that say which objects belong together"
        )


def _by_name(counts: Mapping[_Head, int]) -> dict[str, tuple[int, tuple[Origin, ...]]]:
    """An action's own bindings and those of its conditional effects are one."""
    found: dict[str, tuple[int, tuple[Origin, ...]]] = {}
    for head, count in counts.items():
        found[head.name] = (found.get(head.name, (0, ()))[0] + count, head.origins)
    return found

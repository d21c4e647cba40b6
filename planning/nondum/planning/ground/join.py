"""Finding all bindings of a rule's variables for which its conditions can hold.

Facts come one at a time; each is matched with every condition that it fits, and the others are
looked up among the facts that came before, in an order that is fixed beforehand: those with most
positions bound first. So every binding is found once its last fact is there, without walking
through all combinations of objects. Source: semi-naive evaluation of Datalog, as in Helmert,
Concise finite-domain representations for PDDL planning tasks (2009).
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from nondum.planning.ground.instances import Row
from nondum.planning.ground.matching import Pattern
from nondum.sdk.frozen import frozen

_FEW = 32
"""Up to this number, objects are looked up one by one rather than found among all rows."""

Key: TypeAlias = tuple[str, tuple[int, ...]]
"""A predicate, and the positions that are looked up."""
Values: TypeAlias = list[str]
"""A rule's variables, then the constants that it names; by position."""
Fire: TypeAlias = Callable[[Values], None]
Domains: TypeAlias = Sequence[frozenset[str]]
"""For each variable the objects that it may stand for."""


class Relations:
    """Rows by predicate and by the values at those positions that are looked up."""

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


class TooMuchWork(Exception):
    """More was looked at than may be."""


@dataclass(slots=True)
class Work:
    """How many rows and objects may still be looked at."""

    left: int

    def spend(self, count: int) -> None:
        """Raises `TooMuchWork`."""
        self.left -= count
        if self.left < 0:
            raise TooMuchWork


@frozen
class Query:
    """What a join needs to know."""

    variables: Row
    breadths: Mapping[str, int]
    """Variable → how many objects there are of its types, or were: this only decides the order."""
    patterns: tuple[Pattern, ...]
    equal: tuple[tuple[str, str], ...] = ()
    unequal: tuple[tuple[str, str], ...] = ()

    @property
    def constants(self) -> Row:
        """The objects that it names."""
        named = {term for pattern in self.patterns for term in pattern.terms if term[0] != "?"}
        named |= {t for pair in self.equal + self.unequal for t in pair if t[0] != "?"}
        return tuple(sorted(named))


@frozen
class _Check:
    """Two values that must be the same, or must not."""

    left: int
    right: int
    is_equal: bool


@frozen
class _Step:
    """One loop of a join: over the rows of a table, or over a variable's objects."""

    key: Key | None
    """The table; None: the objects of one variable."""
    look_up: tuple[int, ...] = ()
    """The values to look up in it."""
    new: tuple[tuple[int, int], ...] = ()
    """Position in the row → value that it gives, which must be in the value's domain."""
    named: tuple[tuple[int, str], ...] = ()
    """Positions where a trigger must name an object."""
    same: tuple[tuple[int, int], ...] = ()
    """Positions of a row that must be alike."""
    checks: tuple[_Check, ...] = ()
    whole: tuple[int, ...] = ()
    """Where one value alone is open: the values of a row, so that its few objects can be tried."""


@frozen
class _Run:
    """What a join is run with."""

    relations: Relations
    domains: Domains
    fire: Fire
    work: Work | None


class Join:
    """A rule, prepared for facts that match its condition number `trigger`.

    Without a trigger (None) it finds all bindings among the facts that are there. `known` are
    variables that have a value when it is run.
    """

    def __init__(self, query: Query, trigger: int | None = None, known: Sequence[str] = ()) -> None:
        self._constants = query.constants
        self._at = {name: i for i, name in enumerate((*query.variables, *self._constants))}
        self._size = len(query.variables)
        self._checks = [(pair, True) for pair in query.equal]
        self._checks += [(pair, False) for pair in query.unequal]
        bound = {*self._constants, *known}
        self._first_checks = self._checked(bound)
        self._first: _Step | None = None
        left = list(query.patterns)
        if trigger is not None:
            self._first = self._step(left.pop(trigger), query, bound, is_trigger=True)
        self._steps: list[_Step] = []
        while left:
            best = min(left, key=lambda pattern: _breadth(pattern, query, bound))
            if variable := _narrow(best, query, bound):
                self._steps.append(self._enumeration(variable, bound))
            left.remove(best)
            self._steps.append(self._step(best, query, bound))
        for variable in query.variables:
            if variable not in bound:
                self._steps.append(self._enumeration(variable, bound))

    def _enumeration(self, variable: str, bound: set[str]) -> _Step:
        bound.add(variable)
        return _Step(None, new=((0, self._at[variable]),), checks=self._checked(bound))

    def run(
        self,
        relations: Relations,
        domains: Domains,
        fire: Fire,
        row: Row = (),
        known: Row = (),
        *,
        work: Work | None = None,
    ) -> None:
        """Call `fire` with the values of every binding in which the trigger matches `row`.

        Raises `TooMuchWork` where `work` does not allow for more.
        """
        values = [*known, *[""] * (self._size - len(known)), *self._constants]
        if not _allowed(self._first_checks, values):
            return
        if self._first is None or _taken(self._first, row, values, domains):
            self._walk(0, values, _Run(relations, domains, fire, work))

    def _walk(self, depth: int, values: Values, run: _Run) -> None:
        if depth == len(self._steps):
            run.fire(values)
            return
        step = self._steps[depth]
        if step.key is None:
            ((_, at),) = step.new
            domain = run.domains[at]
            if run.work:
                run.work.spend(len(domain))
            for name in domain:
                values[at] = name
                if _allowed(step.checks, values):
                    self._walk(depth + 1, values, run)
            return
        rows = run.relations.table(step.key).get(tuple([values[i] for i in step.look_up]), ())
        if step.whole and len(rows) > len(run.domains[step.new[0][1]]):
            rows = _rows_among(step, values, run)
        if run.work:
            run.work.spend(len(rows))
        for row in rows:
            if _taken(step, row, values, run.domains):
                self._walk(depth + 1, values, run)

    def _step(
        self, pattern: Pattern, query: Query, bound: set[str], *, is_trigger: bool = False
    ) -> _Step:
        positions: list[int] = []
        new: dict[str, tuple[int, int]] = {}
        same: list[tuple[int, int]] = []
        for position, term in enumerate(pattern.terms):
            if term in bound:
                positions.append(position)
            elif term in new:
                same.append((new[term][0], position))
            else:
                new[term] = (position, self._at[term])
        bound.update(new)
        checks = self._checked(bound)
        opened = tuple(new.values())
        if is_trigger:
            # Nothing is looked up for the trigger, so the objects that it names are compared.
            named = tuple((position, pattern.terms[position]) for position in positions)
            return _Step(None, new=opened, named=named, same=tuple(same), checks=checks)
        key = (pattern.predicate, tuple(positions))
        look_up = tuple(self._at[pattern.terms[position]] for position in positions)
        whole = tuple(self._at[term] for term in pattern.terms) if len(new) == 1 else ()
        return _Step(key, look_up, opened, same=tuple(same), checks=checks, whole=whole)

    def _checked(self, bound: set[str]) -> tuple[_Check, ...]:
        """The comparisons that can be made now; each is made once."""
        ready = [(p, e) for p, e in self._checks if p[0] in bound and p[1] in bound]
        self._checks = [check for check in self._checks if check not in ready]
        return tuple(_Check(self._at[a], self._at[b], is_equal) for (a, b), is_equal in ready)


def _breadth(pattern: Pattern, query: Query, bound: set[str]) -> float:
    """A guess at how many rows fit: all objects of the open variables, fewer for each bound one."""
    open_variables = {term for term in pattern.terms if term not in bound}
    if not open_variables:
        return 0.0
    breadth = math.prod(query.breadths[variable] for variable in open_variables)
    return breadth / 10.0 ** (len(pattern.terms) - len(open_variables))


def _narrow(pattern: Pattern, query: Query, bound: set[str]) -> str:
    """The only variable of a pattern, if trying its objects is quicker than reading all rows."""
    variables = set(pattern.terms)
    if len(variables) != 1 or variables <= bound:
        return ""
    (variable,) = variables
    return variable if query.breadths[variable] <= _FEW else ""


def _rows_among(step: _Step, values: Values, run: _Run) -> Sequence[Row]:
    """The rows of a step with one open value, found by trying its objects."""
    assert step.key is not None  # only rows of a table are looked for
    ((_, at),) = step.new
    table = run.relations.table((step.key[0], tuple(range(len(step.whole)))))
    found: list[Row] = []
    for name in run.domains[at]:
        values[at] = name
        found += table.get(tuple([values[i] for i in step.whole]), ())
    return found


def _taken(step: _Step, row: Row, values: Values, domains: Domains) -> bool:
    """Take a row's values, if they are allowed."""
    for position, at in step.new:
        value = row[position]
        if value not in domains[at]:
            return False
        values[at] = value
    if step.named and any(row[position] != name for position, name in step.named):
        return False
    if step.same and any(row[a] != row[b] for a, b in step.same):
        return False
    return not step.checks or _allowed(step.checks, values)


def _allowed(checks: Sequence[_Check], values: Values) -> bool:
    return all((values[check.left] == values[check.right]) is check.is_equal for check in checks)

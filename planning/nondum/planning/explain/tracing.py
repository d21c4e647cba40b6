"""Tracing what cannot be reached back to what is missing, along the shortest chains.

Conditions that nothing meets and the actions (or rules) that could meet them are a graph: a
condition needs one of its givers, a giver needs all that it lacks. The best causes of each are
settled from the leaves on, so that circles come to nothing.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace

from nondum.planning.explain.cause import Cause, Lack, distinct
from nondum.planning.explain.missing import Missing, Outlook, Shortfall
from nondum.planning.ground.matching import Binding, FactIndex, Pattern, matched
from nondum.planning.ground.members import domains_of
from nondum.planning.merge.core import HOST_PREDICATES
from nondum.planning.merge.domain import Merged
from nondum.planning.merge.goal import GoalExpr
from nondum.planning.pddl.facts import fact, parts
from nondum.planning.pddl.normal import Condition
from nondum.planning.pddl.syntax import (
    Atom,
    Formula,
    Not,
    Quantified,
    TypedName,
    renamed,
    type_text,
)
from nondum.planning.pddl.typegraph import types_or_root
from nondum.sdk.frozen import frozen

_NEEDS_LIMIT = 2000
"""Conditions that are looked at, at most; chains beyond them are not found."""


@frozen
class Need:
    """Facts of which one is wanted, and none can be reached."""

    predicate: str
    terms: tuple[str, ...]
    """Objects; what is not determined is written as `?type`."""
    types: tuple[tuple[str, ...], ...]
    """For each term the types of what is not determined; empty for an object."""

    def __str__(self) -> str:
        return fact(self.predicate, *self.terms)


@frozen
class _Giver:
    """An action, one of its conditional changes, or a rule, and one atom that it makes true."""

    step: str
    """The action's name; empty for a rule, which is not carried out."""
    variables: tuple[TypedName, ...]
    conditions: tuple[Condition, ...]
    atom: Atom
    price: tuple[Atom, ...] = ()
    """The functions that it adds to the cost."""


@dataclass(slots=True)
class _Node:
    """A need: how it could be met, and the best causes known so far."""

    ways: list[_Way] = field(default_factory=list)
    causes: tuple[Cause, ...] | None = None
    users: set[Need] = field(default_factory=set)


@frozen
class _Way:
    """All that one giver lacks: what is missing for good, and what is needed first."""

    step: str
    leaves: tuple[Cause, ...]
    needs: tuple[Need, ...]


class Tracer:
    """Traces goals of one domain."""

    def __init__(self, merged: Merged, outlook: Outlook) -> None:
        self._merged = merged
        self._outlook = outlook
        self._graph = merged.domain.types
        self._givers: defaultdict[str, list[_Giver]] = defaultdict(list)
        for giver in _givers(merged):
            self._givers[giver.atom.predicate].append(giver)
        self._values = FactIndex()
        for function in merged.values:
            self._values.add(*parts(function))
        self._shortfalls: dict[_Giver, Shortfall] = {}
        self._nodes: dict[Need, _Node] = {}

    def causes(self, goal: GoalExpr) -> tuple[Cause, ...]:
        """The fewest causes that keep a goal from being reached, each along its shortest chain.

        Empty where nothing keeps any part of it from being reached.
        """
        shortfall = Shortfall.of((), (goal,), self._outlook)
        ways = [self._told(missing, shortfall) for missing in shortfall.least({})]
        return min(ways, key=_cost)

    def _told(self, missing: Missing, shortfall: Shortfall) -> tuple[Cause, ...]:
        """The causes of what a goal lacks, each with the part of the goal that it is needed for."""
        causes: list[Cause] = []
        for part in missing:
            leaf = _leaf(part, self._outlook)
            found = (leaf,) if leaf else self._roots(_need(part, shortfall))
            wanted = leaf.fact if leaf else _bare(part)
            causes += (replace(cause, goal=wanted) for cause in found)
        return distinct(causes)

    def _roots(self, need: Need) -> tuple[Cause, ...]:
        if need not in self._nodes:
            self._explore(need)
        found = self._nodes[need].causes
        return found if found is not None else (Cause(Lack.CIRCLE, str(need)),)

    def _explore(self, first: Need) -> None:
        """Find everything that a need depends on, and settle the causes from the leaves on."""
        waiting = [first]
        self._nodes[first] = _Node()
        new: list[Need] = []
        while waiting:
            need = waiting.pop()
            new.append(need)
            node = self._nodes[need]
            node.ways = list(self._ways(need))
            for way in node.ways:
                for needed in way.needs:
                    if needed not in self._nodes:
                        if len(self._nodes) >= _NEEDS_LIMIT:
                            continue
                        self._nodes[needed] = _Node()
                        waiting.append(needed)
                    self._nodes[needed].users.add(need)
        self._settle(new)

    def _settle(self, needs: Sequence[Need]) -> None:
        waiting = list(reversed(needs))
        while waiting:
            need = waiting.pop(0)
            node = self._nodes[need]
            best = min(
                (causes for way in node.ways if (causes := self._of(way)) is not None),
                key=_cost,
                default=None,
            )
            if best is not None and (node.causes is None or _cost(best) < _cost(node.causes)):
                node.causes = best
                waiting += sorted(node.users - set(waiting), key=str)

    def _of(self, way: _Way) -> tuple[Cause, ...] | None:
        """What a way comes down to; None while that is not known."""
        causes = list(way.leaves)
        for need in way.needs:
            node = self._nodes.get(need)
            if node is None or node.causes is None:
                return None
            causes += node.causes
        if not way.step:
            return distinct(causes)
        return distinct(replace(cause, path=(way.step, *cause.path)) for cause in causes)

    def _ways(self, need: Need) -> Iterator[_Way]:
        if need.predicate in HOST_PREDICATES and self._merged.self_host:
            yield _Way("", (Cause(Lack.HOST, str(need)),), ())
            return
        could_be_given = False
        for giver in self._givers[need.predicate]:
            shortfall = self._shortfall(giver)
            binding = self._bound_by(giver, need, shortfall)
            if binding is not None:
                could_be_given = True
                yield from self._through(giver, binding, need, shortfall)
        if not could_be_given:
            yield _Way("", (Cause(Lack.ACTION, str(need), terms=need.types),), ())

    def _shortfall(self, giver: _Giver) -> Shortfall:
        if giver not in self._shortfalls:
            found = Shortfall.of(giver.variables, giver.conditions, self._outlook)
            self._shortfalls[giver] = found
        return self._shortfalls[giver]

    def _bound_by(self, giver: _Giver, need: Need, shortfall: Shortfall) -> Binding | None:
        """How an effect becomes what is wanted; what is open there stays open."""
        binding: Binding = {}
        for term, wanted, types in zip(giver.atom.terms, need.terms, need.types, strict=True):
            if not term.is_variable:
                if not (self._is_one_of(term.name, types) if types else term.name == wanted):
                    return None
                continue
            if types:
                if not self._graph.may_be(shortfall.types[term.name], types):
                    return None
                continue
            # A type that nothing has is a cause to be told, so it cannot rule the giver out.
            domain = shortfall.domains[term.name]
            if (domain and wanted not in domain) or binding.setdefault(term.name, wanted) != wanted:
                return None
        return binding

    def _is_one_of(self, name: str, types: tuple[str, ...]) -> bool:
        found = self._merged.objects.get(name)
        return found is None or self._graph.is_one_of(found.types, types)

    def _through(
        self, giver: _Giver, binding: Binding, need: Need, shortfall: Shortfall
    ) -> Iterator[_Way]:
        """The ways in which a giver falls short of giving what is wanted."""
        empty = [v for v in giver.variables if not shortfall.domains[v.name]]
        if empty:
            types = dict.fromkeys(types_or_root(variable.types) for variable in empty)
            yield _Way(giver.step, tuple(Cause(Lack.OBJECT, str(need), t) for t in types), ())
            return
        for missing in shortfall.least(binding):
            leaves = [leaf for part in missing if (leaf := _leaf(part, self._outlook))]
            if not missing:
                unpriced = self._without_value(giver, binding, shortfall)
                lack = Lack.VALUE if unpriced else Lack.EXCLUDED
                leaves = [Cause(lack, unpriced or str(need))]
            needs = [_need(part, shortfall) for part in missing if isinstance(part, Atom)]
            yield _Way(giver.step, tuple(leaves), tuple(dict.fromkeys(needs)))

    def _without_value(self, giver: _Giver, binding: Binding, shortfall: Shortfall) -> str:
        """A function in a giver's cost to which nothing gives a value; empty if there is none."""
        for function in giver.price:
            pattern = Pattern.of(function)
            known = self._values.candidates(pattern, binding)
            if all(matched(pattern, row, binding, shortfall.domains) is None for row in known):
                return _bare(renamed(function, binding))
        return ""


def _leaf(part: Formula, outlook: Outlook) -> Cause | None:
    """What is missing for good; None for what something could give."""
    match part:
        case Atom():
            return None
        case Not(part=Atom() as atom):
            return Cause(Lack.FALSE, _bare(atom))
        case Quantified(variables=variables):
            domains = domains_of(variables, outlook.members)
            empty = next(v for v in variables if not domains[v.name])
            return Cause(Lack.OBJECT, _bare(part), types_or_root(empty.types))
        case _:
            return Cause(Lack.EXCLUDED, _bare(part))


def _bare(part: Formula) -> str:
    return str(part)[1:-1]


def _need(part: Formula, shortfall: Shortfall) -> Need:
    assert isinstance(part, Atom)  # all other parts are leaves
    types = tuple(shortfall.types[term.name] if term.is_variable else () for term in part.terms)
    terms = tuple(
        f"?{type_text(open_)}" if open_ else term.name
        for term, open_ in zip(part.terms, types, strict=True)
    )
    return Need(part.predicate, terms, types)


def _givers(merged: Merged) -> Iterator[_Giver]:
    for action in merged.domain.actions.values():
        before, parameters = action.precondition, action.parameters
        price = action.effect.cost_functions
        for atom in action.effect.add:
            yield _Giver(action.name, parameters, (before,), atom, price)
        for change in action.effect.conditional:
            variables = (*parameters, *change.variables)
            for atom in change.add:
                conditions = (before, change.condition)
                yield _Giver(action.name, variables, conditions, atom, price)
    for rule in merged.domain.derived:
        yield _Giver("", rule.parameters, (rule.condition,), rule.head)


def _cost(causes: Iterable[Cause]) -> tuple[int, int, tuple[tuple[str, ...], ...]]:
    """The fewest causes first, then the shortest chains."""
    paths = tuple(cause.path for cause in causes)
    return len(paths), sum(map(len, paths)), paths

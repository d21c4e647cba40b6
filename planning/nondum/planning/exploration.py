"""What can ever become true, and by which bindings of which actions, if nothing were deleted."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from nondum.planning.domain import Action, Merged, bind
from nondum.planning.facts import parts
from nondum.planning.join import Binding, Pattern, Relations, Rule, bindings, unconditional
from nondum.planning.syntax import Atom, Equal
from nondum.sdk.errors import FragmentRefused, Problem

INSTANCES_LIMIT = 100_000
"""Ground actions that a domain may have."""


@dataclass(frozen=True, slots=True)
class Instance:
    """An action with its parameters bound, in facts."""

    name: str
    """`plugin.action object …`."""
    positive: frozenset[str]
    negative: frozenset[str]
    """Facts that must be false."""
    add: frozenset[str]
    delete: frozenset[str]
    """Without what it also adds: adding wins."""
    cost: int


@dataclass(frozen=True, slots=True)
class Exploration:
    """The delete-relaxed reachable part of a domain."""

    believed: frozenset[str]
    """The facts it began with, those about objects that are not there left out."""
    reachable: frozenset[str]
    instances: tuple[Instance, ...]
    """Sorted by name."""


def explore(
    merged: Merged,
    facts: Iterable[str],
    objects: Mapping[str, tuple[str, ...]] | None = None,
    *,
    limit: int = INSTANCES_LIMIT,
) -> Exploration:
    """Explore from where exactly `facts` hold; `objects` exist beside the merged ones.

    A condition that something is false counts as reachable, unless it is true and nothing can ever
    make it false. Raises `FragmentRefused` (PDDL_TOO_MANY) that names the action with most
    bindings when there are more than `limit`: to leave some out would make a wrong proof.
    """
    types = {name: found.types for name, found in merged.objects.items()} | dict(objects or {})
    believed = frozenset(f for f in facts if all(o in types for o in parts(f)[1]))
    deletable = {a.predicate for action in _actions(merged) for a in action.effect.delete}
    members = members_of(merged, types)
    rules = [(action, _rule(action, members)) for action in _actions(merged)]
    return _Fixpoint(rules, believed, frozenset(deletable), limit).run()


def _actions(merged: Merged) -> Iterable[Action]:
    return merged.domain.actions.values()


def members_of(merged: Merged, types: Mapping[str, tuple[str, ...]]) -> defaultdict[str, set[str]]:
    """Type → the objects of it; `types` are the types of every object."""
    members: defaultdict[str, set[str]] = defaultdict(set)
    for name, of in types.items():
        for type_ in of:
            for above in merged.domain.types.ancestors(type_):
                members[above].add(name)
    return members


def domains_of(action: Action, members: Mapping[str, set[str]]) -> dict[str, frozenset[str]]:
    """Parameter → the objects that it may stand for."""
    return {
        parameter.name: frozenset().union(*(members.get(t, ()) for t in parameter.types))
        for parameter in action.parameters
    }


def _rule(action: Action, members: Mapping[str, set[str]]) -> Rule:
    return Rule(
        variables=tuple(parameter.name for parameter in action.parameters),
        domains=domains_of(action, members),
        patterns=patterns_of(action),
        equal=_pairs(action.precondition.equal),
        unequal=_pairs(action.precondition.unequal),
    )


def patterns_of(action: Action) -> tuple[Pattern, ...]:
    """The conditions that facts must match."""
    return tuple(
        Pattern(atom.predicate, tuple(term.name for term in atom.terms))
        for atom in action.precondition.positive
    )


def _pairs(pairs: Iterable[Equal]) -> tuple[tuple[str, str], ...]:
    return tuple((pair.left.name, pair.right.name) for pair in pairs)


class _Fixpoint:
    """Facts wait in line; each one taken out fires every rule that it completes."""

    def __init__(
        self,
        rules: Iterable[tuple[Action, Rule]],
        believed: frozenset[str],
        deletable: frozenset[str],
        limit: int,
    ) -> None:
        self._rules = tuple(rules)
        self._limit = limit
        self._believed = believed
        self._deletable = deletable
        self._triggers: defaultdict[str, list[tuple[Action, Rule, int]]] = defaultdict(list)
        for action, rule in self._rules:
            for index, pattern in enumerate(rule.patterns):
                self._triggers[pattern.predicate].append((action, rule, index))
        self._reached = set(believed)
        self._waiting = sorted(believed)
        self._relations = Relations()
        self._instances: dict[str, Instance] = {}

    def run(self) -> Exploration:
        for action, rule in self._rules:
            if not rule.patterns:
                for binding in unconditional(rule):
                    self._fire(action, binding)
        while self._waiting:
            predicate, arguments = parts(self._waiting.pop())
            if predicate in self._triggers:
                self._relations.add(predicate, arguments)
                for action, rule, index in self._triggers[predicate]:
                    for binding in bindings(rule, self._relations, index, arguments):
                        self._fire(action, binding)
        instances = tuple(self._instances[name] for name in sorted(self._instances))
        return Exploration(self._believed, frozenset(self._reached), instances)

    def _fire(self, action: Action, binding: Binding) -> None:
        name = " ".join((action.name, *(binding[p.name] for p in action.parameters)))
        if name in self._instances:
            return
        negative = _bound(action.precondition.negative, binding)
        if any(f in self._believed and parts(f)[0] not in self._deletable for f in negative):
            return
        instance = Instance(
            name=name,
            positive=_bound(action.precondition.positive, binding),
            negative=negative,
            add=(add := _bound(action.effect.add, binding)),
            delete=_bound(action.effect.delete, binding) - add,
            cost=action.effect.cost,
        )
        self._instances[name] = instance
        if len(self._instances) > self._limit:
            raise self._too_many()
        new = add - self._reached
        self._reached |= new
        self._waiting += sorted(new)

    def _too_many(self) -> FragmentRefused:
        count = Counter(name.split(" ", 1)[0] for name in self._instances)
        widest = max((action for action, _ in self._rules), key=lambda action: count[action.name])
        message = (
            f"more than {self._limit} ways to bind the actions,"
            f" {count[widest.name]} of them of {widest.name!r}"
        )
        where = " and ".join(map(str, widest.origins))
        fix = "add preconditions that say which objects belong together"
        return FragmentRefused(Problem("PDDL_TOO_MANY", message, where, fix=fix))


def _bound(atoms: Iterable[Atom], binding: Binding) -> frozenset[str]:
    return frozenset(bind(atom, binding) for atom in atoms)

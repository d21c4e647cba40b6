"""What can ever become true, and by which bindings of which actions, if nothing were deleted."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from nondum.planning.domain import Action, Merged, bind
from nondum.planning.facts import parts
from nondum.planning.join import Binding, Pattern, Relations, Rule, bindings, unconditional
from nondum.planning.syntax import Atom, Equal


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
    merged: Merged, facts: Iterable[str], objects: Mapping[str, tuple[str, ...]] | None = None
) -> Exploration:
    """Explore from where exactly `facts` hold; `objects` exist beside the merged ones.

    A condition that something is false counts as reachable, unless it is true and nothing can ever
    make it false.
    """
    types = {name: found.types for name, found in merged.objects.items()} | dict(objects or {})
    believed = frozenset(f for f in facts if all(o in types for o in parts(f)[1]))
    deletable = {a.predicate for action in _actions(merged) for a in action.effect.delete}
    rules = [(action, _rule(action, types, merged)) for action in _actions(merged)]
    return _Fixpoint(rules, believed, frozenset(deletable)).run()


def _actions(merged: Merged) -> Iterable[Action]:
    return merged.domain.actions.values()


def _rule(action: Action, types: Mapping[str, tuple[str, ...]], merged: Merged) -> Rule:
    graph = merged.domain.types
    return Rule(
        variables=tuple(parameter.name for parameter in action.parameters),
        domains={
            parameter.name: frozenset(
                name for name, of in types.items() if graph.is_one_of(of, parameter.types)
            )
            for parameter in action.parameters
        },
        patterns=tuple(
            Pattern(atom.predicate, tuple(term.name for term in atom.terms))
            for atom in action.precondition.positive
        ),
        equal=_pairs(action.precondition.equal),
        unequal=_pairs(action.precondition.unequal),
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
    ) -> None:
        self._rules = tuple(rules)
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
        new = add - self._reached
        self._reached |= new
        self._waiting += sorted(new)


def _bound(atoms: Iterable[Atom], binding: Binding) -> frozenset[str]:
    return frozenset(bind(atom, binding) for atom in atoms)

"""From a literal task to one of positive facts only: what must be false gets a twin.

The twin of a basic fact is kept by the actions that change the fact; that of a derived fact is the
complement of its layer.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import product

from nondum.planning.ground.expansion import is_possible
from nondum.planning.ground.instances import FactTable, Literals
from nondum.planning.ground.literal_task import LiteralTask
from nondum.planning.pddl.facts import twin
from nondum.sdk.errors import FragmentRefused, Problem
from nondum.sdk.planner import ConditionalEffect, GroundAction, GroundTask, Layer, Rule

_WAYS_LIMIT = 256
"""In how many ways the effects of one action may cancel each other."""


def positive_task(literal_task: LiteralTask, table: FactTable) -> GroundTask:
    """Write the task that planners read. Raises `FragmentRefused` (PDDL_TOO_MANY)."""
    return _Writing(literal_task, table).task()


class _Writing:
    def __init__(self, literal_task: LiteralTask, table: FactTable) -> None:
        self._literal_task = literal_task
        literals = frozenset[int]().union(*_conditions(literal_task))
        self._negated = _negated(literal_task, {~literal for literal in literals if literal < 0})
        mentioned = _changed(literal_task).union(max(literal, ~literal) for literal in literals)
        names = {fact: table.text(fact) for fact in mentioned}
        names |= {~fact: twin(names[fact]) for fact in self._negated}
        self._facts = tuple(sorted(names.values()))
        at = {name: index for index, name in enumerate(self._facts)}
        self._at = {literal: at[name] for literal, name in names.items()}
        """Literal → where the fact that stands for it is in the task."""

    def task(self) -> GroundTask:
        layers = self._literal_task.derived
        heads = {rule.head for layer in layers for rule in layer.rules}
        believed = (self._literal_task.init & self._at.keys()) - heads
        false = self._negated - heads - believed
        return GroundTask(
            facts=self._facts,
            init=self._indices((*believed, *(~fact for fact in false))),
            goal=self._indices(self._literal_task.goal),
            actions=tuple(map(self._action, self._literal_task.actions)),
            derived=tuple(self._layer(layer.rules) for layer in layers if layer.rules),
        )

    def _indices(self, literals: Iterable[int]) -> frozenset[int]:
        return frozenset(map(self._at.__getitem__, literals))

    def _layer(self, rules: Iterable[Rule]) -> Layer:
        negated = sorted({rule.head for rule in rules} & self._negated)
        return Layer(
            tuple(Rule(self._at[rule.head], self._indices(rule.body)) for rule in rules),
            tuple((self._at[fact], self._at[~fact]) for fact in negated),
        )

    def _action(self, action: GroundAction) -> GroundAction:
        add, delete = self._changes(action, action.add, action.delete)
        return GroundAction(
            name=action.name,
            precondition=self._indices(action.precondition),
            add=add,
            delete=delete,
            cost=action.cost,
            conditional=tuple(self._conditional(action)) if action.conditional else (),
        )

    def _changes(
        self, action: GroundAction, add: frozenset[int], delete: frozenset[int]
    ) -> tuple[frozenset[int], frozenset[int]]:
        """What one effect of an action adds and deletes, the twins included that surely change."""
        gone = {~fact for fact in delete & self._negated if not _adders(action, fact)}
        came = {~fact for fact in add & self._negated}
        return self._indices(add | gone), self._indices(delete | came)

    def _conditional(self, action: GroundAction) -> Iterator[ConditionalEffect]:
        for change in action.conditional:
            add, delete = self._changes(action, change.add, change.delete)
            if add or delete:
                yield ConditionalEffect(self._indices(change.condition), add, delete)
        for fact in sorted(self._negated):
            yield from self._contested(action, fact)

    def _contested(self, action: GroundAction, fact: int) -> Iterator[ConditionalEffect]:
        """The twin of a fact that is deleted unless a condition adds it at the same time."""
        adders = _adders(action, fact)
        if not adders:
            return
        deleters = [change.condition for change in action.conditional if fact in change.delete]
        if fact in action.delete:
            deleters.append(Literals())
        for deleter in deleters:
            for way in self._ways_not(action, adders):
                both = deleter | way
                if is_possible(both):
                    twin_only = self._indices((~fact,))
                    yield ConditionalEffect(self._indices(both), twin_only, frozenset())

    def _ways_not(
        self, action: GroundAction, adders: Iterable[ConditionalEffect]
    ) -> Iterator[Literals]:
        """The ways in which none of several changes happens."""
        choices = [_single_opposites(change.condition) for change in adders]
        ways = 1
        for choice in choices:
            ways *= len(choice)
        if ways > _WAYS_LIMIT:
            message = f"the effects of {action.name!r} cancel each other in {ways} ways"
            fix = "make a separate action of each case"
            raise FragmentRefused(Problem("PDDL_TOO_MANY", message, fix=fix))
        for way in product(*choices):
            combined = frozenset(way)
            if is_possible(combined):
                yield combined


def _single_opposites(condition: Literals) -> tuple[int, ...]:
    """The literals of which one is enough for a condition not to hold."""
    return tuple(~literal for literal in sorted(condition, key=lambda n: (n < 0, abs(n))))


def _adders(action: GroundAction, fact: int) -> list[ConditionalEffect]:
    return [change for change in action.conditional if fact in change.add]


def _conditions(task: LiteralTask) -> Iterator[Literals]:
    yield task.goal
    for layer in task.derived:
        yield from (rule.body for rule in layer.rules)
    for action in task.actions:
        yield action.precondition
        yield from (change.condition for change in action.conditional)


def _negated(task: LiteralTask, asked: set[int]) -> frozenset[int]:
    """The facts that somewhere must be false: those asked for, and those that decide who wins."""
    negated = frozenset(asked)
    while True:
        more = {
            needed
            for action in task.actions
            if action.conditional
            for fact in negated & _deleted(action)
            for change in _adders(action, fact)
            for needed in change.condition
            if needed >= 0
        }
        if more <= negated:
            return negated
        negated |= more


def _deleted(action: GroundAction) -> frozenset[int]:
    return action.delete.union(*(change.delete for change in action.conditional))


def _changed(task: LiteralTask) -> frozenset[int]:
    """Every fact that something changes."""
    facts = {rule.head for layer in task.derived for rule in layer.rules}
    for action in task.actions:
        facts |= action.add | action.delete
        for change in action.conditional:
            facts |= change.add | change.delete
    return frozenset(facts)

"""From a literal task to one of positive facts only: what must be false gets a twin.

The twin of a basic fact is kept by the actions that change the fact; that of a derived fact is the
complement of its layer.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import product

from nondum.planning.ground.literal_task import LiteralAction, LiteralChange, LiteralTask
from nondum.planning.ground.relations import FactTable
from nondum.planning.pddl.facts import twin
from nondum.planning.pddl.literals import Literals
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
        self._table = table
        self._derived = {rule.head for rule in literal_task.rules}
        self._negated = frozenset(_negated(literal_task))
        mentioned = set(_mentioned(literal_task))
        names = {table.text(fact) for fact in mentioned}
        names |= {twin(table.text(fact)) for fact in self._negated}
        self._facts = tuple(sorted(names))
        at = {name: index for index, name in enumerate(self._facts)}
        self._at = {fact: at[table.text(fact)] for fact in mentioned}
        self._twin = {fact: at[twin(table.text(fact))] for fact in self._negated}

    def task(self) -> GroundTask:
        believed = (self._literal_task.believed & self._at.keys()) - self._derived
        false = self._negated - self._derived - believed
        return GroundTask(
            facts=self._facts,
            init=self._indices(believed) | frozenset(self._twin[fact] for fact in false),
            goal=self._condition(self._literal_task.goal),
            actions=tuple(self._action(action) for action in self._literal_task.actions),
            derived=tuple(
                layer for n in range(self._literal_task.layers) if (layer := self._layer(n)).rules
            ),
        )

    def _indices(self, facts: Iterable[int]) -> frozenset[int]:
        return frozenset(self._at[fact] for fact in facts if fact in self._at)

    def _condition(self, literals: Literals) -> frozenset[int]:
        negative = frozenset(self._twin[fact] for fact in literals.negative)
        return self._indices(literals.positive) | negative

    def _layer(self, number: int) -> Layer:
        rules = [rule for rule in self._literal_task.rules if rule.layer == number]
        negated = sorted({rule.head for rule in rules} & self._negated)
        return Layer(
            tuple(Rule(self._at[rule.head], self._condition(rule.body)) for rule in rules),
            tuple((self._at[fact], self._twin[fact]) for fact in negated),
        )

    def _action(self, action: LiteralAction) -> GroundAction:
        gone = {fact for fact in action.delete & self._negated if not _adders(action, fact)}
        add = self._indices(action.add) | {self._twin[fact] for fact in gone}
        delete = self._indices(action.delete) | {self._twin[f] for f in action.add & self._negated}
        return GroundAction(
            name=action.name,
            precondition=self._condition(action.condition),
            add=add,
            delete=delete,
            cost=action.cost,
            conditional=tuple(self._conditional(action)),
        )

    def _conditional(self, action: LiteralAction) -> Iterator[ConditionalEffect]:
        for change in action.changes:
            lost = {self._twin[fact] for fact in change.add & self._negated}
            sure = {
                self._twin[fact]
                for fact in change.delete & self._negated
                if not _adders(action, fact)
            }
            add, delete = self._indices(change.add) | sure, self._indices(change.delete) | lost
            if add or delete:
                yield ConditionalEffect(self._condition(change.condition), add, delete)
        for fact in sorted(self._negated):
            yield from self._contested(action, fact)

    def _contested(self, action: LiteralAction, fact: int) -> Iterator[ConditionalEffect]:
        """The twin of a fact that is deleted unless a condition adds it at the same time."""
        adders = _adders(action, fact)
        if not adders:
            return
        deleters = [change.condition for change in action.changes if fact in change.delete]
        if fact in action.delete:
            deleters.append(Literals())
        for deleter in deleters:
            for way in self._ways_not(action, adders):
                both = deleter | way
                if both.is_possible:
                    twin_only = frozenset((self._twin[fact],))
                    yield ConditionalEffect(self._condition(both), twin_only, frozenset())

    def _ways_not(
        self, action: LiteralAction, adders: Iterable[LiteralChange]
    ) -> Iterator[Literals]:
        """The ways in which none of several changes happens."""
        choices = [tuple(_single_opposites(change.condition)) for change in adders]
        ways = 1
        for choice in choices:
            ways *= len(choice)
        if ways > _WAYS_LIMIT:
            message = f"the effects of {action.name!r} cancel each other in {ways} ways"
            fix = "make a separate action of each case"
            raise FragmentRefused(Problem("PDDL_TOO_MANY", message, fix=fix))
        for way in product(*choices):
            combined = Literals()
            for one in way:
                combined |= one
            if combined.is_possible:
                yield combined


def _single_opposites(condition: Literals) -> Iterator[Literals]:
    for fact in sorted(condition.positive):
        yield Literals(negative=frozenset((fact,)))
    for fact in sorted(condition.negative):
        yield Literals(positive=frozenset((fact,)))


def _adders(action: LiteralAction, fact: int) -> list[LiteralChange]:
    return [change for change in action.changes if fact in change.add]


def _conditions(literal_task: LiteralTask) -> Iterator[Literals]:
    yield literal_task.goal
    for rule in literal_task.rules:
        yield rule.body
    for action in literal_task.actions:
        yield action.condition
        for change in action.changes:
            yield change.condition


def _negated(literal_task: LiteralTask) -> set[int]:
    """The facts that somewhere must be false, those included that decide who wins."""
    negated = {fact for condition in _conditions(literal_task) for fact in condition.negative}
    while True:
        more = {
            needed
            for action in literal_task.actions
            if action.changes
            for fact in negated & _deleted(action)
            for change in _adders(action, fact)
            for needed in change.condition.positive
        }
        if more <= negated:
            return negated
        negated |= more


def _deleted(action: LiteralAction) -> frozenset[int]:
    return action.delete.union(*(change.delete for change in action.changes))


def _mentioned(literal_task: LiteralTask) -> set[int]:
    facts = {rule.head for rule in literal_task.rules}
    for condition in _conditions(literal_task):
        facts |= condition.positive | condition.negative
    for action in literal_task.actions:
        facts |= action.add | action.delete
        for change in action.changes:
            facts |= change.add | change.delete
    return facts

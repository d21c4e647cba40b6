"""What can help: everything that gives something asked for, backwards from the goal."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import replace

from nondum.planning.ground.instances import Literals
from nondum.planning.ground.literal_task import LiteralTask
from nondum.sdk.planner import ConditionalEffect, GroundAction, Layer, Rule


def helpful(task: LiteralTask) -> LiteralTask:
    """The task without actions and rules that give nothing which anything else asks for.

    Of an effect that may undo something asked for, it is asked that its condition does not hold.
    """
    givers: defaultdict[int, list[int]] = defaultdict(list)
    for index, action in enumerate(task.actions):
        for literal in _given(action):
            givers[literal].append(index)
    rules: defaultdict[int, list[Rule]] = defaultdict(list)
    for rule in (rule for layer in task.derived for rule in layer.rules):
        rules[rule.head].append(rule)
    waiting = list(task.goal)
    asked = set(waiting)
    kept: set[int] = set()

    def ask(literals: Iterable[int]) -> None:
        new = [literal for literal in literals if literal not in asked]
        asked.update(new)
        waiting.extend(new)

    while waiting:
        literal = waiting.pop()
        for rule in rules.get(_fact(literal), ()):
            ask(rule.body if literal >= 0 else _opposites(rule.body))
        for index in givers.get(literal, ()):
            action = task.actions[index]
            if index not in kept:
                kept.add(index)
                ask(action.precondition)
            for change in _giving(action, literal):
                ask(change.condition)
        for index in givers.get(~literal, ()):
            for change in _giving(task.actions[index], ~literal):
                ask(_opposites(change.condition))
    facts = frozenset(map(_fact, asked))
    return replace(
        task,
        actions=tuple(task.actions[index] for index in sorted(kept)),
        derived=tuple(
            Layer(tuple(rule for rule in layer.rules if rule.head in facts))
            for layer in task.derived
        ),
    )


def _fact(literal: int) -> int:
    return max(literal, ~literal)


def _opposites(literals: Literals) -> Iterator[int]:
    return (~literal for literal in literals)


def _given(action: GroundAction) -> frozenset[int]:
    literals = action.add.union(_opposites(action.delete), *(c.add for c in action.conditional))
    return literals.union(*(_opposites(change.delete) for change in action.conditional))


def _giving(action: GroundAction, literal: int) -> Iterator[ConditionalEffect]:
    """The conditional effects that make a literal true."""
    for change in action.conditional:
        if literal in change.add or ~literal in change.delete:
            yield change

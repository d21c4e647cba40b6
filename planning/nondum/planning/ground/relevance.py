"""What can help: everything that gives something asked for, backwards from the goal."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import replace
from typing import TypeAlias

from nondum.planning.ground.literal_task import LiteralAction, LiteralRule, LiteralTask
from nondum.planning.pddl.literals import Literals

Literal: TypeAlias = tuple[int, bool]
"""A fact, and whether it is to be true."""


def helpful(literal_task: LiteralTask) -> LiteralTask:
    """The task without actions and rules that give nothing which anything else asks for.

    Of an effect that may undo something asked for, it is asked that its condition does not hold.
    """
    givers: defaultdict[Literal, list[int]] = defaultdict(list)
    for index, action in enumerate(literal_task.actions):
        for literal in _given(action):
            givers[literal].append(index)
    rules: defaultdict[int, list[LiteralRule]] = defaultdict(list)
    for rule in literal_task.rules:
        rules[rule.head].append(rule)
    waiting = list(_literals(literal_task.goal))
    asked = set(waiting)
    kept: set[int] = set()

    def ask(literals: Iterator[Literal]) -> None:
        for literal in literals:
            if literal not in asked:
                asked.add(literal)
                waiting.append(literal)

    while waiting:
        fact, is_true = literal = waiting.pop()
        for rule in rules.get(fact, ()):
            ask(_literals(rule.body if is_true else _opposite(rule.body)))
        for index in givers.get(literal, ()):
            action = literal_task.actions[index]
            if index not in kept:
                kept.add(index)
                ask(_literals(action.condition))
            ask(_asked_by_changes(action, literal))
        for index in givers.get((fact, not is_true), ()):
            ask(_asked_against(literal_task.actions[index], (fact, not is_true)))
    asked_facts = {fact for fact, _ in asked}
    actions = (literal_task.actions[index] for index in sorted(kept))
    return replace(
        literal_task,
        actions=tuple(actions),
        rules=tuple(rule for rule in literal_task.rules if rule.head in asked_facts),
    )


def _literals(literals: Literals) -> Iterator[Literal]:
    yield from ((fact, True) for fact in literals.positive)
    yield from ((fact, False) for fact in literals.negative)


def _opposite(literals: Literals) -> Literals:
    return Literals(literals.negative, literals.positive)


def _given(action: LiteralAction) -> set[Literal]:
    literals = {(fact, True) for fact in action.add} | {(fact, False) for fact in action.delete}
    for change in action.changes:
        literals |= {(fact, True) for fact in change.add}
        literals |= {(fact, False) for fact in change.delete}
    return literals


def _asked_by_changes(action: LiteralAction, literal: Literal) -> Iterator[Literal]:
    """What the changes that give a literal ask for."""
    fact, is_true = literal
    for change in action.changes:
        if fact in (change.add if is_true else change.delete):
            yield from _literals(change.condition)


def _asked_against(action: LiteralAction, harm: Literal) -> Iterator[Literal]:
    """What keeps the changes that would undo something from happening."""
    fact, is_true = harm
    for change in action.changes:
        if fact in (change.add if is_true else change.delete):
            yield from _literals(_opposite(change.condition))

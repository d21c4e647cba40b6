"""What can become true in a task that is written out, if nothing is ever deleted."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

from nondum.planning.pddl.literals import Literals

if TYPE_CHECKING:
    from nondum.planning.ground.literal_task import LiteralTask


def reachable(literal_task: LiteralTask) -> LiteralTask:
    """Only what can happen if nothing is ever deleted; negative conditions count as met."""
    reached = reached_in(literal_task)
    return replace(
        literal_task,
        actions=tuple(a for a in literal_task.actions if a.condition.positive <= reached),
        rules=tuple(rule for rule in literal_task.rules if rule.body.positive <= reached),
    )


def reached_in(literal_task: LiteralTask) -> frozenset[int]:
    """The facts that can become true if nothing is ever deleted."""
    needs: dict[int, list[int]] = {}
    gives: list[frozenset[int]] = []
    missing: list[int] = []
    for condition, given in _givers(literal_task):
        for fact in condition.positive:
            needs.setdefault(fact, []).append(len(gives))
        gives.append(given)
        missing.append(len(condition.positive))
    reached = set(literal_task.believed)
    waiting = list(reached)
    ready = [index for index, count in enumerate(missing) if not count]
    while ready or waiting:
        while ready:
            new = gives[ready.pop()] - reached
            reached |= new
            waiting += new
        if waiting:
            for index in needs.get(waiting.pop(), ()):
                missing[index] -= 1
                if not missing[index]:
                    ready.append(index)
    return frozenset(reached)


def _givers(literal_task: LiteralTask) -> Iterator[tuple[Literals, frozenset[int]]]:
    """Everything that makes facts true, with what it needs."""
    for action in literal_task.actions:
        yield action.condition, action.add
        for change in action.changes:
            yield action.condition | change.condition, change.add
    for rule in literal_task.rules:
        yield rule.body, frozenset((rule.head,))

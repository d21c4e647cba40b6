"""What can become true if nothing were ever deleted: the cheap proof of impossibility."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, TypeAlias

from nondum.planning.ground.progression import start
from nondum.sdk.planner import AlreadyTrue, GroundTask, Layer, Unsolvable

if TYPE_CHECKING:
    from nondum.planning.ground.literal_task import LiteralTask

Giver: TypeAlias = tuple[frozenset[int], frozenset[int]]
"""The facts that an action, a conditional effect or a rule needs, and those that it makes true."""


def reachable_facts(task: GroundTask | LiteralTask) -> frozenset[int]:
    """The facts that some sequence of actions makes true, deletes ignored.

    What must be false, and the complement of a derived fact, count as met: of a literal task its
    negative literals are among what is returned.
    """
    complements = {other for layer in task.derived for _, other in layer.complements}
    return _fixpoint(task.init | complements, _givers(task))


def reachable_part(task: LiteralTask) -> LiteralTask:
    """The task without the actions and rules whose conditions are out of reach."""
    reached = reachable_facts(task)
    return replace(
        task,
        actions=tuple(a for a in task.actions if a.precondition <= reached),
        derived=tuple(
            Layer(tuple(rule for rule in layer.rules if rule.body <= reached))
            for layer in task.derived
        ),
    )


def quick_answer(
    task: GroundTask, reached: frozenset[int] | None = None
) -> AlreadyTrue | Unsolvable | None:
    """The answer that needs no search: the goal holds, or cannot be reached even without deletes.

    None: a planner must look. `reached` are the task's `reachable_facts`, where they are known.
    """
    if task.goal <= start(task):
        return AlreadyTrue()
    unreached = task.goal - (reachable_facts(task) if reached is None else reached)
    if unreached:
        return Unsolvable("relaxed", tuple(task.facts[index] for index in sorted(unreached)))
    return None


def _fixpoint(facts: Iterable[int], givers: Iterable[Giver]) -> frozenset[int]:
    """The facts, and all that the givers make of them."""
    needing: defaultdict[int, list[int]] = defaultdict(list)
    missing: list[int] = []
    given: list[frozenset[int]] = []
    for index, (needs, gives) in enumerate(givers):
        missing.append(len(needs))
        given.append(gives)
        for needed in needs:
            needing[needed].append(index)
    reached = {*facts, *(literal for literal in needing if literal < 0)}
    waiting = list(reached)
    ready = [index for index, count in enumerate(missing) if count == 0]
    while waiting or ready:
        while ready:
            new = given[ready.pop()] - reached
            reached |= new
            waiting += new
        if waiting:
            for index in needing[waiting.pop()]:
                missing[index] -= 1
                if missing[index] == 0:
                    ready.append(index)
    return frozenset(reached)


def _givers(task: GroundTask | LiteralTask) -> Iterator[Giver]:
    for action in task.actions:
        yield action.precondition, action.add
        for effect in action.conditional:
            if effect.add:
                yield action.precondition | effect.condition, effect.add
    for layer in task.derived:
        for rule in layer.rules:
            yield rule.body, frozenset((rule.head,))

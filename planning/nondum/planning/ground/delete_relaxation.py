"""What a ground task can reach if nothing were ever deleted: the cheap proof of impossibility."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator

from nondum.planning.ground.progression import start
from nondum.sdk.planner import AlreadyTrue, GroundTask, Unsolvable


def reachable(task: GroundTask) -> frozenset[int]:
    """The facts that some sequence of actions makes true, deletes ignored.

    The complement of a derived fact counts as reachable.
    """
    needing: defaultdict[int, list[int]] = defaultdict(list)
    missing: list[int] = []
    given: list[frozenset[int]] = []
    for index, (condition, add) in enumerate(_changes(task)):
        missing.append(len(condition))
        given.append(add)
        for needed in condition:
            needing[needed].append(index)
    reached = set(task.init)
    reached.update(other for layer in task.derived for _, other in layer.complements)
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


def _changes(task: GroundTask) -> Iterator[tuple[frozenset[int], frozenset[int]]]:
    """Everything that makes facts true: what it needs, and what it gives."""
    for action in task.actions:
        yield action.precondition, action.add
        for effect in action.conditional:
            if effect.add:
                yield action.precondition | effect.condition, effect.add
    for layer in task.derived:
        for rule in layer.rules:
            yield rule.body, frozenset((rule.head,))


def quick_answer(task: GroundTask) -> AlreadyTrue | Unsolvable | None:
    """The answer that needs no search: the goal holds, or cannot be reached even without deletes.

    None: a planner must look.
    """
    if task.goal <= start(task):
        return AlreadyTrue()
    unreached = task.goal - reachable(task)
    if unreached:
        return Unsolvable("relaxed", tuple(task.facts[index] for index in sorted(unreached)))
    return None

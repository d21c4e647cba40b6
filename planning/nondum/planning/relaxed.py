"""What a ground task can reach if nothing were ever deleted: the cheap proof of impossibility."""

from __future__ import annotations

from collections import defaultdict

from nondum.sdk.planner import AlreadyTrue, GroundTask, Unsolvable


def reachable(task: GroundTask) -> frozenset[int]:
    """The facts that some sequence of actions makes true, deletes ignored."""
    needing: defaultdict[int, list[int]] = defaultdict(list)
    missing = []
    for index, action in enumerate(task.actions):
        missing.append(len(action.precondition))
        for needed in action.precondition:
            needing[needed].append(index)
    reached = set(task.init)
    waiting = list(task.init)
    ready = [index for index, count in enumerate(missing) if count == 0]
    while waiting or ready:
        while ready:
            new = task.actions[ready.pop()].add - reached
            reached |= new
            waiting += new
        if waiting:
            for index in needing[waiting.pop()]:
                missing[index] -= 1
                if missing[index] == 0:
                    ready.append(index)
    return frozenset(reached)


def quick_answer(task: GroundTask) -> AlreadyTrue | Unsolvable | None:
    """The answer that needs no search: the goal holds, or cannot be reached even without deletes.

    None: a planner must look.
    """
    if task.goal <= task.init:
        return AlreadyTrue()
    unreached = task.goal - reachable(task)
    if unreached:
        return Unsolvable("relaxed", tuple(task.facts[index] for index in sorted(unreached)))
    return None

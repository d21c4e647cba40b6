"""What a ground action makes of a state: the meaning of ground tasks, in one place.

Planners have their own, quicker ones; plans are checked against this.
"""

from __future__ import annotations

from collections import defaultdict

from nondum.sdk.planner import GroundAction, GroundTask, Layer

State = frozenset[int]
"""The facts that hold, derived ones included."""


def start(task: GroundTask) -> State:
    """The state that a task begins with."""
    return settled(task, task.init)


def progress(task: GroundTask, state: State, action: GroundAction) -> State:
    """The state after an action whose precondition holds in `state`."""
    add, delete = changes(action, state)
    return settled(task, (state - derived_facts(task) - delete) | add)


def changes(action: GroundAction, state: State) -> tuple[frozenset[int], frozenset[int]]:
    """What an action adds and deletes in a state; what is in both is added."""
    if not action.conditional:
        return action.add, action.delete
    happening = [effect for effect in action.conditional if effect.condition <= state]
    return (
        action.add.union(*(effect.add for effect in happening)),
        action.delete.union(*(effect.delete for effect in happening)),
    )


def derived_facts(task: GroundTask) -> frozenset[int]:
    """The facts that follow from others and are never changed by actions."""
    heads = {rule.head for layer in task.derived for rule in layer.rules}
    return frozenset(heads).union(*(pair for layer in task.derived for pair in layer.complements))


def settled(task: GroundTask, basic: frozenset[int]) -> State:
    """A state, given the facts in it that are not derived."""
    state = set(basic)
    for layer in task.derived:
        _settle(layer, state)
    return frozenset(state)


def _settle(layer: Layer, state: set[int]) -> None:
    needing: defaultdict[int, list[int]] = defaultdict(list)
    missing = [len(rule.body - state) for rule in layer.rules]
    for index, rule in enumerate(layer.rules):
        for needed in rule.body - state:
            needing[needed].append(index)
    ready = [index for index, count in enumerate(missing) if count == 0]
    while ready:
        head = layer.rules[ready.pop()].head
        if head in state:
            continue
        state.add(head)
        for index in needing[head]:
            missing[index] -= 1
            if missing[index] == 0:
                ready.append(index)
    state |= {other for fact, other in layer.complements if fact not in state}

"""Whether a plan still holds after a recomposition: it is simulated in the new task, by name."""

from __future__ import annotations

from collections.abc import Iterable

from nondum.planning.facts import holds
from nondum.planning.partial_order import bits
from nondum.planning.regression import Regression, Rest
from nondum.planning.step import steps_of, words
from nondum.sdk.planner import GroundTask, Plan


def replayed(
    task: GroundTask, names: Iterable[str], believed: frozenset[str], lasting: frozenset[str]
) -> Plan | None:
    """The steps of an old plan that `task` still has, if what is left of them reaches its goal.

    `names` are the old plan's actions in order, `believed` is what holds now. Steps that are done
    already may be gone; they stay in the plan where they are not, to be done again if undone.
    """
    index = {action.name: number for number, action in enumerate(task.actions)}
    kept = [index[name] for name in names if name in index]
    plan = Plan(tuple(kept), sum(task.actions[number].cost for number in kept))
    regression = Regression(steps_of(task, plan, lasting), words(task, task.goal))
    state = frozenset(fact for fact in task.facts if holds(fact, believed))
    rest = regression.rest(state)
    if not isinstance(rest, Rest):
        return None
    for number in bits(rest.steps):
        step = regression.steps[number]
        if not step.precondition <= state:
            return None
        state = state - step.delete | step.add
    return plan if regression.goal <= state else None

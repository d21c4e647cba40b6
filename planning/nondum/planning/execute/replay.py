"""Whether a plan still holds after a recomposition: it is simulated in the new task, by name."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from nondum.planning.execute.partial_order import bits
from nondum.planning.execute.regression import Regression, Rest
from nondum.planning.execute.step import steps_of, words
from nondum.planning.ground.progression import State, derived_facts, progress, settled
from nondum.planning.pddl.facts import holds
from nondum.sdk.planner import GroundTask, Plan


def replayed(
    task: GroundTask, names: Iterable[str], believed: frozenset[str], lasting: frozenset[str]
) -> Plan | None:
    """The steps of an old plan that `task` still has, if what is left of them reaches its goal.

    `names` are the old plan's actions in order, `believed` is what holds now. Steps that are done
    already may be gone; they stay in the plan where they are not, to be done again if undone.
    """
    variants: dict[str, list[int]] = {}
    for number, action in enumerate(task.actions):
        variants.setdefault(action.name, []).append(number)
    kept = [name for name in names if name in variants]
    state = beginning_at(task, believed).init
    if task.features or any(len(variants[name]) > 1 for name in kept):
        return _simulated(task, kept, variants, state)
    plan = _plan(task, [variants[name][0] for name in kept])
    regression = Regression(steps_of(task, plan, lasting), words(task, task.goal))
    rest = regression.rest(words(task, state))
    if not isinstance(rest, Rest):
        return None
    for number in bits(rest.steps):
        action = task.actions[plan.steps[number]]
        if not action.precondition <= state:
            return None
        state = progress(task, state, action)
    return plan if task.goal <= state else None


def beginning_at(task: GroundTask, believed: frozenset[str]) -> GroundTask:
    """The same task where exactly the facts in `believed` hold."""
    holding = frozenset(n for n, text in enumerate(task.facts) if holds(text, believed))
    return replace(task, init=holding - derived_facts(task))


def _simulated(
    task: GroundTask, names: Sequence[str], variants: Mapping[str, Sequence[int]], state: State
) -> Plan | None:
    """The shortest end of the plan that reaches the goal, where steps depend on the state."""
    for first in range(len(names), -1, -1):
        taken = _taken(task, [variants[name] for name in names[first:]], state)
        if taken is not None:
            return _plan(task, taken)
    return None


def _taken(task: GroundTask, steps: Iterable[Sequence[int]], basic: State) -> list[int] | None:
    """One variant of each step, so that all can be taken and the goal holds; None if there is none
    to be had by taking the first that fits."""
    state, taken = settled(task, basic), []
    for variants in steps:
        fitting = [n for n in variants if task.actions[n].precondition <= state]
        if not fitting:
            return None
        taken.append(fitting[0])
        state = progress(task, state, task.actions[fitting[0]])
    return taken if task.goal <= state else None


def _plan(task: GroundTask, steps: Sequence[int]) -> Plan:
    return Plan(tuple(steps), sum(task.actions[number].cost for number in steps))

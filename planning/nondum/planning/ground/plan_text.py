"""Plans of planners that ground by themselves, in the indices of a ground task."""

from __future__ import annotations

from collections import defaultdict

from nondum.planning.ground.progression import progress, start
from nondum.sdk.errors import Problem
from nondum.sdk.planner import GroundTask, Plan, PlanText


def plan_of(task: GroundTask, text: PlanText) -> Plan | Problem:
    """The plan that a text tells, or what is wrong with it.

    Of several actions of one name (a disjunctive precondition makes them) one that can be is taken.
    A step that the task has no action for is left out: ground tasks lack the actions that cannot
    help. The plan may still be invalid. Code: PLAN_STEP_IMPOSSIBLE.
    """
    called: defaultdict[str, list[int]] = defaultdict(list)
    for index, action in enumerate(task.actions):
        called[action.name].append(index)
    state, steps = start(task), []
    for position, name in enumerate(text.steps, 1):
        if name not in called:
            continue
        possible = (i for i in called[name] if task.actions[i].precondition <= state)
        step = next(possible, None)
        if step is None:
            return Problem("PLAN_STEP_IMPOSSIBLE", f"step {position}, {name}, cannot be taken")
        steps.append(step)
        state = progress(task, state, task.actions[step])
    return Plan(tuple(steps), sum(task.actions[step].cost for step in steps))

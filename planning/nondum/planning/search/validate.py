"""An independent check of a plan: step by step, with nothing of any planner's."""

from __future__ import annotations

from nondum.planning.ground.progression import progress, start
from nondum.sdk.errors import Problem
from nondum.sdk.planner import GroundTask, Plan


def validate(task: GroundTask, plan: Plan) -> tuple[Problem, ...]:
    """What is wrong with a plan; nothing if each step can be taken and the goal holds at the end.

    Codes: PLAN_STEP_UNKNOWN, PLAN_STEP_IMPOSSIBLE, PLAN_GOAL_MISSED, PLAN_COST.
    """
    state = start(task)
    for position, index in enumerate(plan.steps, 1):
        if not 0 <= index < len(task.actions):
            message = f"step {position} is action {index} of {len(task.actions)}"
            return (Problem("PLAN_STEP_UNKNOWN", message),)
        action = task.actions[index]
        missing = action.precondition - state
        if missing:
            message = f"step {position}, {action.name}, needs {_named(task, missing)}"
            return (Problem("PLAN_STEP_IMPOSSIBLE", message),)
        state = progress(task, state, action)
    problems = []
    if task.goal - state:
        message = f"at the end {_named(task, task.goal - state)} does not hold"
        problems.append(Problem("PLAN_GOAL_MISSED", message))
    cost = sum(task.actions[index].cost for index in plan.steps)
    if cost != plan.cost:
        problems.append(
            Problem(
                "PLAN_COST", "the cost is not the sum of its steps", "", str(cost), str(plan.cost)
            )
        )
    return tuple(problems)


def _named(task: GroundTask, facts: frozenset[int]) -> str:
    return ", ".join(f"({task.facts[index]})" for index in sorted(facts))

"""A plan tried out on the schemas themselves, with nothing of what grounding makes of them.

Ground tasks lack what cannot help, and a plan of somebody else's may well have it; and a mistake
made in grounding would not be seen there.
"""

from __future__ import annotations

from collections.abc import Iterable

from nondum.planning.ground.lifted import Meaning, Situation
from nondum.planning.ground.static import Names
from nondum.planning.merge.domain import Action, Merged, bind
from nondum.planning.merge.goal import GoalExpr
from nondum.planning.pddl.caret import nearest
from nondum.planning.pddl.normal import Condition
from nondum.planning.pddl.syntax import renamed, type_text
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen

LISTED = 8
"""Missing conditions that are named, at most."""


@frozen
class Rehearsed:
    """What came of trying out a plan."""

    taken: int
    """How many of its steps could be taken."""
    cost: int
    """Of these steps."""
    problems: tuple[Problem, ...] = ()
    """Why it does not reach the goal; none if it does."""


def rehearsed(
    merged: Merged, facts: Iterable[str], goal: GoalExpr, steps: Iterable[str]
) -> Rehearsed:
    """Try out a plan: `action obj …` for each step, from where exactly `facts` hold.

    Codes: PLAN_STEP_UNKNOWN, PLAN_STEP_IMPOSSIBLE, PLAN_GOAL_MISSED.
    """
    meaning = Meaning(merged, {name: found.types for name, found in merged.objects.items()})
    situation = meaning.situation(meaning.start(facts))
    taken = cost = 0
    for step in steps:
        what = f"step {taken + 1}, ({step})"
        found = _bound(merged, step, what)
        if isinstance(found, Problem):
            return Rehearsed(taken, cost, (found,))
        action, names = found
        price = _price(merged, action, names)
        missing = _missing(situation, action.precondition, names)
        if price is None:
            missing = "a cost, which no function gives"
        if missing:
            problem = Problem("PLAN_STEP_IMPOSSIBLE", f"{what}, needs {missing}")
            return Rehearsed(taken, cost, (problem,))
        taken, cost = taken + 1, cost + (price or 0)
        situation = meaning.situation(meaning.after(situation, action, names))
    if missing := _missing(situation, goal, {}):
        message = f"at the end the goal is missed: {missing}"
        return Rehearsed(taken, cost, (Problem("PLAN_GOAL_MISSED", message),))
    return Rehearsed(taken, cost)


def _missing(situation: Situation, condition: Condition, names: Names) -> str:
    parts = [str(renamed(part, names)) for part in situation.missing(condition, names)]
    more = f" and {len(parts) - LISTED} more" if len(parts) > LISTED else ""
    return ", ".join(parts[:LISTED]) + more


def _bound(merged: Merged, step: str, what: str) -> tuple[Action, Names] | Problem:
    """The schema of a step, and what its parameters stand for."""
    name, *objects = step.split(" ")
    actions = merged.domain.actions
    if name not in actions:
        message = f"{what}: there is no action {name!r}"
        return Problem("PLAN_STEP_UNKNOWN", message, fix=nearest(name, actions))
    action = actions[name]
    if len(objects) != len(action.parameters):
        message = f"{what}: {name!r} has {len(action.parameters)} parameters"
        return Problem("PLAN_STEP_UNKNOWN", message)
    for value, parameter in zip(objects, action.parameters, strict=True):
        thing = merged.objects.get(value)
        if thing is None:
            message = f"{what}: there is no object {value!r}"
            return Problem("PLAN_STEP_UNKNOWN", message, fix=nearest(value, merged.objects))
        if not merged.domain.types.is_one_of(thing.types, parameter.types):
            message = (
                f"{what}: {value} is {type_text(thing.types)}, "
                f"{parameter.name} is {type_text(parameter.types)}"
            )
            return Problem("PLAN_STEP_UNKNOWN", message)
    return action, {p.name: o for p, o in zip(action.parameters, objects, strict=True)}


def _price(merged: Merged, action: Action, names: Names) -> int | None:
    """None where a function that it adds has no value: then it cannot be taken (PDDL 2.1)."""
    values = [merged.values.get(bind(function, names)) for function in action.effect.cost_functions]
    known = [value for value in values if value is not None]
    return action.effect.cost + sum(known) if len(known) == len(values) else None

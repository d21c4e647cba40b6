"""Plans that are kept though the world, or the composition, is another than they were made in."""

from __future__ import annotations

from nondum.host.mind.composition import Composition
from nondum.host.mind.goals import GivenGoal
from nondum.host.mind.pursued import Pursued
from nondum.host.mind.search import task_of
from nondum.host.mind.situation import Planned, Situation
from nondum.planning.execute.replay import beginning_at, replayed
from nondum.planning.ground.conditional_effects import plain
from nondum.planning.merge.goal import parse_goal
from nondum.sdk.errors import FragmentRefused, GoalRefused
from nondum.sdk.planner import GroundTask, Plan


def kept(
    composition: Composition,
    given: GivenGoal,
    one: Pursued,
    situation: Situation,
    believed: frozenset[str],
) -> tuple[GroundTask, Plan] | None:
    """The plan of a goal in a new composition, if what is left of it still reaches the goal."""
    try:
        goal = parse_goal(given.pddl, composition.merged, kind=given.kind)
    except GoalRefused:
        return None
    try:
        task = task_of(composition, goal, situation)
    except FragmentRefused:  # too many ways: the plan at hand goes on, guarded as before
        task = one.task
    plan = replayed(task, one.names, believed, composition.merged.lasting())
    return None if plan is None else plain(beginning_at(task, believed), plan)


def still_works(composition: Composition, found: Planned, believed: frozenset[str]) -> bool:
    """Whether a plan that was just found reaches its goal from what is believed now."""
    return replayed(found.task, found.names, believed, composition.merged.lasting()) is not None

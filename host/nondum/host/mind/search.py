"""From a goal to a plan: ground, search, check, and if there is none, say why."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from nondum.host.mind.composition import Composition
from nondum.host.mind.diagnosis import Seen, why_not, words_gone
from nondum.host.mind.goals import GivenGoal
from nondum.host.mind.planners import Planners
from nondum.host.mind.silence import Silence
from nondum.planning.bounds import INSTANCES_LIMIT
from nondum.planning.cutting import cut_short
from nondum.planning.domain import Merged
from nondum.planning.goal import Goal, goal_problems, parse_goal
from nondum.planning.ground import ground
from nondum.planning.oversize import Fitted, fitted
from nondum.planning.pddl_text import pddl_text
from nondum.planning.plain import plain
from nondum.planning.pricing import at_own_cost, handicaps, priced
from nondum.sdk.errors import FragmentRefused, GoalRefused, Problem
from nondum.sdk.planner import AlreadyTrue, GaveUp, GroundTask, Plan, Unsolvable

AT_ONCE = 2_000
"""Ground actions that the loop can spare the time for: some tens of milliseconds."""
SMALL = 20
"""Up to so many components, grounding takes less of the loop than a thread's switching does."""


@dataclass(frozen=True, slots=True)
class Situation:
    """What a search depends on: the same situation gives the same answer."""

    goal: str
    """Id of the goal."""
    revision: int
    facts: frozenset[str]
    """What holds when no lasting behaviour runs."""
    excluded: frozenset[str]
    """Actions that failed too often to be planned with for now."""

    def is_like(self, other: Situation) -> bool:
        """Whether only facts differ: a search goes on, and its plan is checked when it comes."""
        return (self.goal, self.revision, self.excluded) == (
            other.goal,
            other.revision,
            other.excluded,
        )


@dataclass(frozen=True, slots=True)
class Planned:
    """A plan for a goal, in the task that it is valid in."""

    situation: Situation
    task: GroundTask
    plan: Plan
    planner: str = ""
    took_s: float = 0.0
    left_out: Mapping[str, Problem] = field(default_factory=dict)
    """Components that were not planned with, for they have too many ways to act."""

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the steps' actions."""
        return tuple(self.task.actions[step].name for step in self.plan.steps)


@dataclass(frozen=True, slots=True)
class NoPlan:
    """There is none, or none was found; the problems say why."""

    situation: Situation
    problems: tuple[Problem, ...]
    left_out: Mapping[str, Problem] = field(default_factory=dict)
    """Components that were not planned with, for they have too many ways to act."""


@dataclass(frozen=True, slots=True)
class Past:
    """What is remembered from before a search."""

    seen: tuple[Seen, ...] = ()
    """The components that were here: they may bring what is missing."""
    failures: Mapping[str, str] = field(default_factory=dict)
    """Actions that are excluded, and how they failed."""
    left_out: Mapping[str, Problem] = field(default_factory=dict)
    """Components that are known to have too many ways to act."""


def task_of(
    composition: Composition, goal: Goal, situation: Situation, *, limit: int = AT_ONCE
) -> GroundTask:
    """The ground task of a goal, without the actions that are excluded.

    Raises `FragmentRefused` (PDDL_TOO_MANY) for more than `limit` bound actions; up to `AT_ONCE`
    of them are made in a time that the loop can spare.
    """
    return _task(composition.merged, goal, situation, limit=limit)


async def search(
    planners: Planners,
    composition: Composition,
    given: GivenGoal,
    situation: Situation,
    *,
    deadline_s: float,
    past: Past | None = None,
) -> Planned | NoPlan:
    """Find a plan, or say why there is none.

    A component with too many ways to act is left out of the task, and told of in the answer.
    """
    past = past or Past()
    try:
        goal = parse_goal(given.pddl, composition.merged, kind=given.kind)
    except GoalRefused as refused:
        gone = await asyncio.to_thread(words_gone, composition.merged, given.pddl, past.seen)
        return NoPlan(situation, gone or refused.problems)
    try:
        fit = await _task_of_any_size(composition, goal, situation, past.left_out)
    except FragmentRefused as refused:
        return NoPlan(situation, refused.problems)
    found = await _searched(planners, composition, goal, situation, deadline_s, past, fit)
    return replace(found, left_out=fit.left_out)


async def _searched(
    planners: Planners,
    composition: Composition,
    goal: Goal,
    situation: Situation,
    deadline_s: float,
    past: Past,
    fit: Fitted[GroundTask | None],
) -> Planned | NoPlan:
    task, too_big = fit.made, tuple(fit.left_out.values())
    if task is None:
        return NoPlan(situation, too_big)
    handicap = handicaps(composition.contributions, composition.host)
    found = await planners.plan(
        priced(task, handicap),
        deadline_s,
        lambda: pddl_text(fit.merged, situation.facts, goal.expr),
    )
    match found.answer:
        case AlreadyTrue():
            task, nothing = plain(task, Plan((), 0))
            return Planned(situation, task, nothing, took_s=found.took_s)
        case Plan() as dear:
            task, plan = plain(task, at_own_cost(task, dear))
            if problem := cut_short(composition.merged, task, plan):
                return NoPlan(situation, (problem,))
            return Planned(situation, task, plan, found.planner, found.took_s)
        case GaveUp(why):
            message = f"it is not known whether there is a plan: {why}"
            fix = "ask again with a longer planning.deadline_s, or for less"
            return NoPlan(situation, (Problem("NO_ANSWER", message, fix=fix), *too_big))
        case Unsolvable():
            failures = {name: past.failures.get(name, "") for name in situation.excluded}
            problems = await asyncio.to_thread(
                why_not,
                fit.merged,
                goal,
                situation.facts,
                past.seen,
                failures,
                Silence.of(composition.snapshot),
            )
            return NoPlan(situation, (*problems, *too_big))


async def _task_of_any_size(
    composition: Composition, goal: Goal, situation: Situation, left_out: Mapping[str, Problem]
) -> Fitted[GroundTask | None]:
    """The task, made at once where that is short, in a thread where it would hold up the loop.

    It is without the components that make it too big; None where the goal's words are theirs.
    """
    if len(composition.contributions) <= SMALL and not left_out:
        with contextlib.suppress(FragmentRefused):
            return Fitted(task_of(composition, goal, situation), composition.merged, {})

    def make(merged: Merged) -> GroundTask | None:
        if merged is not composition.merged and goal_problems(goal, merged):
            return None
        return _task(merged, goal, situation, limit=INSTANCES_LIMIT)

    return await asyncio.to_thread(
        fitted, composition.contributions, composition.merged, make, left_out
    )


def _task(merged: Merged, goal: Goal, situation: Situation, *, limit: int) -> GroundTask:
    task = ground(merged, situation.facts, goal.expr, limit=limit)
    kept = tuple(a for a in task.actions if a.name not in situation.excluded)
    return replace(task, actions=kept)

"""From a goal to a plan: ground, search, check, and if there is none, say why."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import partial
from typing import TypeAlias

from nondum.host.mind.composition import Composition
from nondum.host.mind.diagnosis import WhyNot, why_not, words_gone
from nondum.host.mind.goals import GivenGoal
from nondum.host.mind.missing_reports import Silence
from nondum.host.mind.planners import Planners
from nondum.host.mind.situation import NoPlan, Outcome, Past, Planned, Situation, Waits
from nondum.planning.execute.independence import Reservation, conflicting, kept_clear
from nondum.planning.execute.step import steps_of, words
from nondum.planning.ground.bounds import INSTANCES_LIMIT
from nondum.planning.ground.conditional_effects import plain
from nondum.planning.ground.ground import ground
from nondum.planning.ground.oversize import Fitted, fitted
from nondum.planning.ground.pddl_text import pddl_text
from nondum.planning.ground.pricing import at_own_cost, handicaps, priced
from nondum.planning.merge.domain import Merged
from nondum.planning.merge.goal import Goal, goal_problems, parse_goal
from nondum.planning.search.interruptions import cut_short
from nondum.sdk.errors import FragmentRefused, GoalRefused, Problem
from nondum.sdk.frozen import frozen
from nondum.sdk.planner import AlreadyTrue, GaveUp, GroundTask, Plan, Unsolvable

BESIDE_S = 2.0
"""How long a plan is searched for that leaves those of other goals alone."""
AT_ONCE = 2_000
"""Ground actions that the loop can spare the time for: some tens of milliseconds."""
SMALL = 20
"""Up to this number of components, grounding takes less time than switching to a thread."""


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
) -> Outcome:
    """Find a plan, or say why there is none.

    It leaves the plans of other goals alone where that can be, else those of more urgent ones. A
    component with too many ways to act is left out of the task, and told of in the answer.
    """
    searching = _Searching(planners, composition, given, past or Past())
    found = await searching.plan(situation, deadline_s)
    others, exclusive = situation.others, composition.exclusive
    if isinstance(found, NoPlan) or not others.all:
        return found
    in_the_way = searching.shared(found, others.all)
    if not in_the_way:
        return found
    firm = frozenset(other.goal for other in others.firm)
    ways = [(others.all, others.with_all)]
    if others.yielding and firm & in_the_way.keys():
        ways.append((others.firm, others.with_firm))
    for beside, facts in ways:
        there, time_s = replace(situation, facts=facts), min(deadline_s, BESIDE_S)
        narrowed = partial(kept_clear, others=beside, exclusive=exclusive)
        another = await searching.plan(there, time_s, narrowed)
        if isinstance(another, Planned) and not searching.shared(another, beside):
            aside = searching.shared(another, others.yielding)
            return replace(another, situation=situation, beside=beside, puts_aside=aside)
    behind = {goal: what for goal, what in in_the_way.items() if goal in firm}
    if behind:
        return Waits(situation, behind, found.left_out)
    return replace(found, puts_aside=in_the_way)


_Narrowing: TypeAlias = Callable[[GroundTask], GroundTask]


@frozen
class _Searching:
    """Searches for plans for one goal."""

    planners: Planners
    composition: Composition
    given: GivenGoal
    past: Past

    async def plan(
        self, situation: Situation, deadline_s: float, narrowed: _Narrowing | None = None
    ) -> Planned | NoPlan:
        """One search. Why there is no plan in a narrowed task is not asked."""
        merged, given = self.composition.merged, self.given
        try:
            goal = parse_goal(given.pddl, merged, kind=given.kind)
        except GoalRefused as refused:
            gone = await asyncio.to_thread(words_gone, merged, given.pddl, self.past.seen)
            return NoPlan(situation, gone or refused.problems)
        try:
            left_out = self.past.left_out
            fit = await _task_of_any_size(self.composition, goal, situation, left_out)
        except FragmentRefused as refused:
            return NoPlan(situation, refused.problems)
        too_big = tuple(fit.left_out.values())
        if fit.made is None:
            return NoPlan(situation, too_big, fit.left_out)
        task = narrowed(fit.made) if narrowed else fit.made
        found = await self._answered(task, fit.merged, goal, situation, deadline_s)
        if isinstance(found, Planned):
            return replace(found, left_out=fit.left_out)
        why = WhyNot(found.problems if found else ())
        if found is None and narrowed is None:
            why = await self._why_not(fit.merged, goal, situation)
        return NoPlan(situation, (*why.problems, *too_big), fit.left_out, why.needs)

    def shared(self, plan: Planned, others: Iterable[Reservation]) -> dict[str, str]:
        """Goal → what its plan shares with this one, of those that cannot be beside it."""
        steps = steps_of(plan.task, plan.plan, self.composition.merged.lasting())
        goal = words(plan.task, plan.task.goal)
        exclusive = self.composition.exclusive
        return conflicting(Reservation.of(self.given.id, steps, goal, exclusive), others)

    async def _answered(
        self, task: GroundTask, merged: Merged, goal: Goal, situation: Situation, deadline_s: float
    ) -> Planned | NoPlan | None:
        """What the planners say; None: there is no plan."""
        handicap = handicaps(self.composition.contributions, self.composition.host)
        found = await self.planners.plan(
            priced(task, handicap),
            deadline_s,
            lambda: pddl_text(merged, situation.facts, goal.expr),
        )
        match found.answer:
            case AlreadyTrue():
                task, nothing = plain(task, Plan((), 0))
                return Planned(situation, task, nothing, took_s=found.took_s)
            case Plan() as dear:
                task, plan = plain(task, at_own_cost(task, dear))
                if problem := cut_short(self.composition.merged, task, plan):
                    return NoPlan(situation, (problem,))
                return Planned(situation, task, plan, found.planner, found.took_s)
            case GaveUp(why):
                message = f"it is not known whether there is a plan: {why}"
                fix = "ask again with a longer planning.deadline_s, or for less"
                return NoPlan(situation, (Problem("NO_ANSWER", message, fix=fix),))
            case Unsolvable():
                return None

    async def _why_not(self, merged: Merged, goal: Goal, situation: Situation) -> WhyNot:
        failures = {name: self.past.failures.get(name, "") for name in situation.excluded}
        silence = Silence.of(self.composition.snapshot)
        return await asyncio.to_thread(
            why_not, merged, goal, situation.facts, self.past.seen, failures, silence
        )


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

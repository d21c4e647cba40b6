"""From a goal to a plan: ground, search, check, and if there is none, say why."""

from __future__ import annotations

import asyncio
import contextlib
import re
from collections.abc import Iterable
from dataclasses import dataclass, replace

from nondum.host.mind.composition import Composition
from nondum.host.mind.goals import GivenGoal
from nondum.host.mind.planners import Planners
from nondum.planning.claims import claims_of
from nondum.planning.contribution import Contribution
from nondum.planning.explain import explain, suppliers
from nondum.planning.exploration import INSTANCES_LIMIT
from nondum.planning.goal import Goal, parse_goal
from nondum.planning.ground import ground
from nondum.planning.partial_order import causal_links, threats
from nondum.planning.plain import plain
from nondum.planning.pricing import at_own_cost, handicaps, priced
from nondum.planning.step import steps_of, words
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

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the steps' actions."""
        return tuple(self.task.actions[step].name for step in self.plan.steps)


@dataclass(frozen=True, slots=True)
class NoPlan:
    """There is none, or none was found; the problems say why."""

    situation: Situation
    problems: tuple[Problem, ...]


def task_of(
    composition: Composition, goal: Goal, situation: Situation, *, limit: int = AT_ONCE
) -> GroundTask:
    """The ground task of a goal, without the actions that are excluded.

    Raises `FragmentRefused` (PDDL_TOO_MANY) for more than `limit` bound actions; up to `AT_ONCE`
    of them are made in a time that the loop can spare.
    """
    task = ground(composition.merged, situation.facts, goal.expr, limit=limit)
    kept = tuple(a for a in task.actions if a.name not in situation.excluded)
    return replace(task, actions=kept)


async def search(
    planners: Planners,
    composition: Composition,
    given: GivenGoal,
    situation: Situation,
    *,
    deadline_s: float,
    seen: Iterable[Contribution] = (),
) -> Planned | NoPlan:
    """Find a plan, or say why there is none.

    `seen` are contributions of components that were here once: they may be what is missing.
    """
    try:
        goal = parse_goal(given.pddl, composition.merged, kind=given.kind)
    except GoalRefused as refused:
        return NoPlan(situation, words_gone(composition, given, seen) or refused.problems)
    try:
        task = await _task_of_any_size(composition, goal, situation)
    except FragmentRefused as refused:
        return NoPlan(situation, refused.problems)
    handicap = handicaps(composition.contributions, composition.host)
    found = await planners.plan(priced(task, handicap), deadline_s)
    match found.answer:
        case AlreadyTrue():
            task, nothing = plain(task, Plan((), 0))
            return Planned(situation, task, nothing, took_s=found.took_s)
        case Plan() as dear:
            task, plan = plain(task, at_own_cost(task, dear))
            if problem := cut_short(composition, task, plan):
                return NoPlan(situation, (problem,))
            return Planned(situation, task, plan, found.planner, found.took_s)
        case GaveUp(why):
            fix = "ask again with a longer planning.deadline_s, or for less"
            problem = Problem("NO_ANSWER", f"no planner found a plan: {why}", fix=fix)
            return NoPlan(situation, (problem,))
        case Unsolvable():
            problems = await asyncio.to_thread(why_not, composition, goal, situation, tuple(seen))
            return NoPlan(situation, problems)


def cut_short(composition: Composition, task: GroundTask, plan: Plan) -> Problem | None:
    """What is wrong with a plan that ends a lasting behaviour before its effects are used."""
    steps = steps_of(task, plan, composition.merged.lasting())
    found = threats(steps, causal_links(steps, words(task, task.goal)))
    if not found:
        return None
    breaker, provider = steps[found[0].breaker].name, steps[found[0].link.provider or 0].name
    message = f"{breaker} ends {provider}, whose ({found[0].link.fact}) is needed after it"
    return Problem("PLAN_CUT_SHORT", message)


def why_not(
    composition: Composition, goal: Goal, situation: Situation, seen: Iterable[Contribution]
) -> tuple[Problem, ...]:
    """What is missing for a goal that cannot be reached, and who used to supply it."""
    diagnosis = explain(composition.merged, situation.facts, goal.expr)
    if situation.excluded and not diagnosis.causes:
        names = ", ".join(sorted(situation.excluded))
        message = f"there is no way without what failed again and again: {names}"
        return (Problem("NO_OTHER_WAY", message, fix="it is tried again after a while"),)
    gone = _gone(composition, suppliers(diagnosis.causes, seen))
    problems = diagnosis.problems()
    if gone:
        names = ", ".join(sorted({c.component for c in gone}))
        problems += (Problem("WHY_SUPPLIER", f"{names} used to supply it", fix=f"plug in {names}"),)
    return problems


def words_gone(
    composition: Composition, given: GivenGoal, seen: Iterable[Contribution]
) -> tuple[Problem, ...]:
    """Which of a goal's words mean nothing any more, and who brought them. Empty: none."""
    merged = composition.merged
    lost = {*re.findall(r"[^\s()]+", given.pddl)} - {*merged.domain.predicates, *merged.objects}
    brought = {c.component: lost & _names(c) for c in _gone(composition, seen)}
    words = ", ".join(sorted({repr(word) for found in brought.values() for word in found}))
    names = ", ".join(sorted(component for component, found in brought.items() if found))
    if not words:
        return ()
    message = f"{words} means nothing without {names}, which brought it"
    return (Problem("WHY_WORDS_GONE", message, fix=f"plug in {names}"),)


def _names(contribution: Contribution) -> set[str]:
    """The predicates and objects that a contribution declares."""
    claims = claims_of(contribution)
    return {
        *(predicate.name for predicate in claims.predicates),
        *(claim.name for claim in claims.objects),
        *(unit.object for unit in contribution.units),
        *(stream.object for stream in contribution.streams),
    }


def _gone(composition: Composition, seen: Iterable[Contribution]) -> list[Contribution]:
    """Those that are not here now."""
    present = {contribution.component for contribution in composition.contributions}
    return [contribution for contribution in seen if contribution.component not in present]


async def _task_of_any_size(
    composition: Composition, goal: Goal, situation: Situation
) -> GroundTask:
    """The task, made at once where that is short, in a thread where it would hold up the loop."""
    if len(composition.contributions) <= SMALL:
        with contextlib.suppress(FragmentRefused):
            return task_of(composition, goal, situation)
    return await asyncio.to_thread(task_of, composition, goal, situation, limit=INSTANCES_LIMIT)

"""The pursuit of goals: which, by which plans, and what happens when the world says otherwise.

Goals whose plans take nothing from each other are pursued side by side; of others the more urgent
one goes first. While another plan is searched for, one at a time, the tree at hand goes on as far
as it can by itself; it is replaced between two ticks, and what runs and is still needed runs on.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import replace

from nondum.host.core.events import Emit, GoalEnded, GoalReached, PlanMade, PlanMissing
from nondum.host.core.records import ComponentState
from nondum.host.mind import short_names
from nondum.host.mind.announcements import People, kept_out
from nondum.host.mind.beliefs import Beliefs
from nondum.host.mind.composition import Composition
from nondum.host.mind.diagnosis import Seen, seen_in
from nondum.host.mind.goals import GivenGoal, GoalQueue, GoalState, is_replaced, urgency
from nondum.host.mind.planners import Planners
from nondum.host.mind.pursued import Pursued, conflicts
from nondum.host.mind.search import search, task_of
from nondum.host.mind.search_order import Turns
from nondum.host.mind.situation import NoPlan, OtherPlans, Outcome, Past, Planned, Situation, Waits
from nondum.planning.execute.attempts import Attempts, Patience, Setbacks
from nondum.planning.execute.independence import Reservation
from nondum.planning.execute.plan_executive import Phase, PlanExecutive
from nondum.planning.execute.replay import beginning_at, replayed
from nondum.planning.execute.running import Run
from nondum.planning.execute.running_leaves import RunningLeaves
from nondum.planning.execute.task_tree import TaskTree
from nondum.planning.ground.conditional_effects import plain
from nondum.planning.merge.goal import parse_goal
from nondum.sdk.errors import FragmentRefused, GoalRefused, Problem
from nondum.sdk.planner import GroundTask, Plan

log = logging.getLogger(__name__)


class Pursuit:
    """Keeps the goals that can be had, the most urgent ones first, each in a task tree."""

    def __init__(
        self,
        *,
        queue: GoalQueue,
        beliefs: Beliefs,
        leaves: RunningLeaves,
        planners: Planners,
        people: People,
        emit: Emit,
        now_s: Callable[[], float],
        deadline_s: float,
        patience: Patience,
        wake: Callable[[], None],
    ) -> None:
        """`wake` asks for a tick: a search has ended."""
        self.queue = queue
        self._pursued: dict[str, Pursued] = {}
        self._beliefs = beliefs
        self._leaves = leaves
        self._planners = planners
        self._people = people
        self._emit = emit
        self._now_s = now_s
        self._deadline_s = deadline_s
        self._patience = patience
        self._wake = wake
        self._composition: Composition | None = None
        self._seen: tuple[Seen, ...] = ()
        self._left_out: dict[str, Problem] = {}
        self._failures: dict[str, str] = {}
        self._search: asyncio.Task[Outcome] | None = None
        self._searched_for: Situation | None = None
        self._tried: dict[int, Situation] = {}
        """By the number of a goal: one that is given again under its id was not tried yet."""
        self._turns = Turns()
        self._excluded_until_s: dict[str, float] = {}
        self.setbacks = Setbacks()
        self._left_over: tuple[Run, ...] = ()
        self._facts: dict[frozenset[str], frozenset[str]] = {}
        """Actions that go on → what holds then, at one revision of the world."""
        self._facts_of = -1

    @property
    def pursued(self) -> tuple[Pursued, ...]:
        """The goals that are pursued now, the most urgent first."""
        return tuple(sorted(self._pursued.values(), key=lambda one: urgency(self.queue[one.goal])))

    @property
    def trees(self) -> tuple[TaskTree, ...]:
        """The task trees to tick."""
        return tuple(one.tree for one in self.pursued)

    @property
    def seen(self) -> tuple[Seen, ...]:
        """The components that were here, as far as they are remembered."""
        return self._seen

    @property
    def left_out(self) -> tuple[tuple[str, Problem], ...]:
        """The components that are not planned with, for they have too many ways to act."""
        return tuple(sorted(self._left_out.items()))

    @property
    def runs(self) -> tuple[Run, ...]:
        """All that was started and has not been seen to end, of this plan and of those before."""
        current = (run for one in self.pursued for run in one.tree.control.runs.values())
        return _once((*current, *self._left_over))

    @property
    def failures(self) -> dict[str, str]:
        """The actions that are excluded, and how they failed."""
        return {name: self._failures.get(name, "") for name in sorted(self.excluded)}

    @property
    def troubles(self) -> dict[str, str]:
        """Actions that fail and are tried again, or are left out for it, and how they failed."""
        controls = [one.tree.control for one in self.pursued]
        well = {name for control in controls for name in control.proven(self._now_s())}
        attempts = [control.attempts for control in controls]
        attempts = attempts or [Attempts(self._patience, self.setbacks)]
        return {
            name: why
            for one in attempts
            for name in one.troubled()
            if name not in well and (why := one.trouble(name))
        }

    @property
    def is_searching(self) -> bool:
        """Whether a plan is being searched for."""
        return self._search is not None

    @property
    def excluded(self) -> frozenset[str]:
        """The actions that failed too often to be planned with for now."""
        now_s = self._now_s()
        return frozenset(n for n, until_s in self._excluded_until_s.items() if until_s > now_s)

    # Between ticks

    def step(self) -> None:
        """Draw the conclusions of the last tick, and see to plans for what is wanted."""
        self._left_over = tuple(r for r in self._left_over if not r.action.state.has_ended)
        for one in self.pursued:
            self._conclude(one)
        self._take_found()
        if self._composition is None:
            return
        self.drop_ended("its goal is over")
        while (goal := self._next()) is not None:
            if not self._is_searched_for(goal):
                self._start_search(goal)
            if self._search is not None:
                return
        self._cancel_search()

    def adopt(self, composition: Composition) -> None:
        """Go on with the plan in a new composition if it still works there."""
        before = self._composition.contributions if self._composition else ()
        if not set(before) <= set(composition.contributions):  # what is left may be small enough
            self._note_left_out({})
        if self._composition is None or _parts(self._composition) != _parts(composition):
            self._excluded_until_s.clear()  # what it failed for may be another now
            self.setbacks.clear()
        self._turns.restart()
        self._composition = composition
        self._seen = seen_in(composition.snapshot)
        for one in self.pursued:
            kept = self._replayed(composition, one)
            if kept is None:
                one.is_outdated = True
            else:
                self._grow(one.goal, *kept, phase=one.phase)
        for goal in conflicts(self.pursued):
            self._pursued[goal].is_outdated = True

    def drop(self, because: str, goal: str | None = None) -> tuple[str, ...]:
        """Stop pursuing a goal, or all: everything that runs for it is halted. Gives its names."""
        dropped = [one for one in self.pursued if goal in (None, one.goal)]
        runs = [run for one in dropped for run in one.tree.control.runs.values()]
        for one in dropped:
            one.tree.halt(because)
            self._left_over = _once((*self._left_over, *one.tree.release()))
            del self._pursued[one.goal]
        return tuple(run.step.name for run in _once(runs))

    def drop_ended(self, because: str) -> tuple[str, ...]:
        """Stop pursuing goals that are over. Gives the names of what is halted."""
        over = [one.goal for one in self.pursued if self.queue[one.goal].state.is_final]
        return tuple(name for goal in over for name in self.drop(because, goal))

    async def close(self) -> None:
        """Stop searching and pursuing."""
        self.drop("the host is stopping")
        if self._search is not None:
            self._search.cancel()
            await asyncio.gather(self._search, return_exceptions=True)

    # What the last tick came to

    def _conclude(self, one: Pursued) -> None:
        control = one.tree.control
        if not control.decisions:  # not ticked yet
            return
        phase = control.phase
        if phase is not one.phase:
            one.phase, one.trouble = phase, ""
            self._tell_phase(one, phase)
        for name in control.proven(self._now_s()):
            control.attempts.effective(name)
        if phase is Phase.UNDER_WAY and (trouble := control.trouble()) != one.trouble:
            one.trouble = trouble
            self.queue.put(one.goal, GoalState.ACTIVE, trouble)
        if phase is Phase.REACHED:
            goal = self.queue.put(one.goal, GoalState.REACHED, control.answer or "it holds")
            if goal.kind == "do":  # the next time that it is asked for, it is done again
                self._beliefs.world.withdraw_effects(control.regression.goal)
            self._emit(GoalReached(one.goal))
            self.drop("the goal is reached", one.goal)

    def _tell_phase(self, one: Pursued, phase: Phase) -> None:
        goal = self.queue[one.goal]
        if phase is Phase.REACHED:
            answer = one.tree.control.answer
            told = f"{goal.text}: {answer}" if answer else f"goal {goal.id} is reached: {goal.text}"
            self._people.tell(told)
        elif phase is Phase.HOLDING:
            self.queue.put(goal.id, GoalState.ACTIVE, "it holds and is kept so")
            self._people.tell(f"goal {goal.id} holds and is kept so: {goal.text}")
        elif phase is Phase.UNDER_WAY:
            self.queue.put(goal.id, GoalState.ACTIVE, "")
        elif why := one.tree.needs_replan:
            self.queue.put(goal.id, GoalState.ACTIVE, f"another plan is needed: {why}")
            self._people.tell(f"goal {goal.id} needs another plan: {why}")

    # Searching

    def _situation(self, goal: str) -> Situation:
        revision = self._composition.revision if self._composition else 0
        world = self._beliefs.world
        return Situation(goal, revision, world.bare_facts, self.excluded, self._other_plans(goal))

    def _other_plans(self, goal: str) -> OtherPlans:
        others = [one for one in self.pursued if one.goal != goal]
        if not others:
            return OtherPlans()
        mine = urgency(self.queue[goal])
        firm = [one for one in others if urgency(self.queue[one.goal]) < mine]
        yielding = others[len(firm) :]
        return OtherPlans(
            tuple(one.reservation for one in firm),
            tuple(one.reservation for one in yielding),
            self._facts_with(firm),
            self._facts_with(others),
        )

    def _facts_with(self, others: Iterable[Pursued]) -> frozenset[str]:
        """What holds while other goals are pursued, and nothing else runs."""
        world = self._beliefs.world
        if self._facts_of != world.revision:
            self._facts_of = world.revision
            self._facts.clear()
        runs = (run for one in others for run in one.tree.control.runs.values())
        going_on = frozenset(run.step.name for run in runs if not run.is_halting)
        if going_on not in self._facts:
            ended = {run.step.name for run in self.runs} - going_on
            self._facts[going_on] = world.facts_without(ended)
        return self._facts[going_on]

    def _is_on_its_way(self, goal: GivenGoal) -> bool:
        """Whether a goal has a plan that goes on, or nothing new is known since none was found."""
        if one := self._pursued.get(goal.id):
            self._exclude(one.tree.control)
            return not one.is_outdated and one.tree.needs_replan is None
        tried = self._tried.get(goal.number)
        if tried is None:
            return False
        now = self._situation(goal.id)
        return tried == now if goal.state is GoalState.SUSPENDED else tried.is_like(now)

    def _next(self) -> GivenGoal | None:
        due = [goal for goal in self.queue.open() if not self._is_on_its_way(goal)]
        searched = next(filter(self._is_searched_for, due), None)
        return self._turns.next(due, searched, self._pursued)

    def _is_searched_for(self, goal: GivenGoal) -> bool:
        asked = self._searched_for
        return asked is not None and asked.is_like(self._situation(goal.id))

    def _exclude(self, control: PlanExecutive) -> None:
        now_s = self._now_s()
        for name in control.exhausted:
            self._failures[name] = control.attempts.given_up(name) or ""
            if self._excluded_until_s.get(name, 0.0) <= now_s:
                attempts = control.attempts
                reason, failures = attempts.last_failure(name), attempts.count(name)
                setback = self.setbacks.note(name, failures, reason)
                self._excluded_until_s[name] = now_s + setback.cool_down_s

    def _start_search(self, wanted: GivenGoal) -> None:
        assert self._composition is not None  # `step` waits for one
        situation = self._situation(wanted.id)
        if self._tried.get(wanted.number) == situation:
            self._give_up_plan(wanted)
            return
        self._cancel_search()
        self._searched_for = situation
        self._search = asyncio.create_task(
            search(
                self._planners,
                self._composition,
                wanted,
                situation,
                deadline_s=self._deadline_s,
                past=Past(self.seen, dict(self._failures), dict(self._left_out)),
            )
        )
        self._search.add_done_callback(lambda _: self._wake())

    def _give_up_plan(self, wanted: GivenGoal) -> None:
        """The plan at hand is stuck, and nothing new is known that another could be made of."""
        one = self._pursued.get(wanted.id)
        why = one.tree.needs_replan if one else None
        problem = Problem("PLAN_STUCK", why or "its plan does not go on", where=f"goal {wanted.id}")
        self._suspend(NoPlan(self._situation(wanted.id), (problem,)))

    def _cancel_search(self) -> None:
        if self._search is not None:
            self._search.cancel()
            self._search = self._searched_for = None

    def _take_found(self) -> None:
        if self._search is None or self._searched_for is None or not self._search.done():
            return
        found = self._outcome(self._search, self._searched_for)
        self._search = self._searched_for = None
        goal = found.situation.goal
        if self.queue[goal].state.is_final or not found.situation.is_like(self._situation(goal)):
            return
        number = self.queue[goal].number
        self._tried[number] = found.situation
        self._note_left_out(found.left_out)
        if isinstance(found, NoPlan):
            self._suspend(found)
        elif isinstance(found, Waits):
            self._wait(found)
        elif self._still_works(found):
            self._take_up(found)
        else:
            del self._tried[number]  # the world has moved on; `step` searches again

    def _note_left_out(self, left_out: Mapping[str, Problem]) -> None:
        known = {component: (problem,) for component, problem in self._left_out.items()}
        now = {
            component: known.get(component, (problem,)) for component, problem in left_out.items()
        }
        kept_out(self._people, known, now)
        self._left_out = dict(left_out)

    def _outcome(self, search: asyncio.Task[Outcome], asked: Situation) -> Outcome:
        """What a search came to; a fault in planning is contained, and told like a missing plan."""
        error = search.exception()
        if error is None:
            return search.result()
        log.error("a search for a plan failed", exc_info=error)
        problem = Problem("PLANNING_FAULT", f"planning failed: {type(error).__name__}: {error}")
        return NoPlan(asked, (problem,))

    def _still_works(self, found: Planned) -> bool:
        assert self._composition is not None  # there was a search
        beside = {other.goal for other in found.beside}
        believed = self._facts_with(one for one in self.pursued if one.goal in beside)
        lasting = self._composition.merged.lasting()
        return replayed(found.task, found.names, believed, lasting) is not None

    def _suspend(self, found: NoPlan) -> None:
        goal = self.queue[found.situation.goal]
        self._tried[goal.number] = found.situation
        self.drop("there is no plan any more", goal.id)
        if goal.state is not GoalState.SUSPENDED or goal.problems != found.problems:
            words = "; ".join(problem.message for problem in found.problems)
            fixes = "; ".join(problem.fix for problem in found.problems if problem.fix)
            self._people.tell(f"cannot {goal.text!r} now: {words}{f' → {fixes}' if fixes else ''}")
            self._emit(PlanMissing(goal.id, found.problems))
        reason = found.problems[0].message
        self.queue.put(goal.id, GoalState.SUSPENDED, reason, found.problems, found.needs)

    def _wait(self, found: Waits) -> None:
        goal = self.queue[found.situation.goal]
        self.drop("more urgent goals need what it uses", goal.id)
        newer = (id for id in found.behind if is_replaced(goal, self.queue[id]))
        first = next(newer, next(iter(found.behind)))
        self._put_aside(goal.id, first, found.behind[first])

    def _put_aside(self, goal: str, behind: str, shared: str) -> None:
        was = self.queue[goal]
        now = self.queue.put_aside(goal, behind, shared)
        if (was.state, was.reason) != (now.state, now.reason):
            self._people.tell(f"goal {now.id} {_WAITS[now.state]}{now.reason}: {now.text}")
        if now.state.is_final:
            self._emit(GoalEnded(now.id, now.reason))

    # Taking up a plan

    def _take_up(self, found: Planned) -> None:
        goal = self.queue[found.situation.goal]
        reason = self._why_another_plan(goal.id)
        handed_over: list[Run] = []
        for id, shared in found.puts_aside.items():
            if one := self._pursued.pop(id, None):
                handed_over += one.tree.release()
                self._tried.pop(self.queue[id].number, None)  # it is put aside, not given up
                self._put_aside(id, goal.id, shared)
        # Without those that it put aside the answer is the same.
        self._tried[goal.number] = replace(found.situation, others=self._other_plans(goal.id))
        self.queue.put(goal.id, GoalState.ACTIVE)
        self._grow(goal.id, found.task, found.plan, runs=handed_over)
        called = short_names.steps(found.names, {})
        steps = ", then ".join(called.values()) or "nothing to do"
        because = f", because {reason}" if reason else ""
        self._people.tell(f"plan for {goal.text!r}{because}: {steps}")
        self._emit(PlanMade(goal.id, found.situation.revision, found.names, reason))

    def _why_another_plan(self, goal: str) -> str:
        one = self._pursued.get(goal)
        return (one.tree.needs_replan or "the components changed") if one else ""

    def _grow(
        self,
        id: str,
        task: GroundTask,
        plan: Plan,
        *,
        phase: Phase = Phase.UNDER_WAY,
        runs: Collection[Run] = (),
    ) -> None:
        """Put the tree of a plan in the place of the present one of that goal; `runs` are those of
        goals that are put aside."""
        assert self._composition is not None  # there is a task
        before = self._pursued.get(id)
        halting = [run for run in self.runs if run.is_halting]  # units may not be free before
        own = before.tree.release() if before else ()
        goal, exclusive = self.queue[id], self._composition.exclusive
        tree = TaskTree(
            task,
            plan,
            lasting=self._composition.merged.lasting(),
            leaves=self._leaves,
            kind=goal.kind,
            sight=lambda: (self._beliefs.world, self._now_s()),
            exclusive=exclusive,
            runs=_once((*own, *runs, *halting)),
            patience=self._patience,
            setbacks=self.setbacks,
            name=f"goal {goal.id}",
        )
        kept = tree.control.regression
        reservation = Reservation.of(id, kept.steps, kept.goal, exclusive)
        self._pursued[id] = Pursued(id, task, plan, tree, reservation, phase=phase)

    def _replayed(self, composition: Composition, one: Pursued) -> tuple[GroundTask, Plan] | None:
        """The plan in the new composition, if what is left of it still reaches the goal there."""
        given = self.queue[one.goal]
        try:
            goal = parse_goal(given.pddl, composition.merged, kind=given.kind)
        except GoalRefused:
            return None
        try:
            task = task_of(composition, goal, self._situation(one.goal))
        except FragmentRefused:  # too many ways: the plan at hand goes on, guarded as before
            task = one.task
        believed = self._beliefs.world.facts
        plan = replayed(task, one.names, believed, composition.merged.lasting())
        return None if plan is None else plain(beginning_at(task, believed), plan)


_WAITS = {GoalState.QUEUED: "", GoalState.HALTED: "is "}


def _once(runs: Iterable[Run]) -> tuple[Run, ...]:
    """Each run once: those that are being halted are known to every tree."""
    return tuple({id(run): run for run in runs}.values())


def _parts(composition: Composition) -> tuple[object, ...]:
    """What an action's failure may come from: who is here, with which devices, and where units sit.
    Workers that are started again by themselves change nothing of that."""
    snapshot, given_up = composition.snapshot, ComponentState.QUARANTINED
    own = ((c.id, c.devices, c.state is given_up) for c in snapshot.components)
    return (*composition.contributions, *own, *snapshot.mounts)

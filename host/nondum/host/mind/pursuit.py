"""The pursuit of goals: which, by which plans, and what happens when the world says otherwise.

Goals whose plans take nothing from each other are pursued side by side; of others the more urgent
one goes first. While another plan is searched for, one at a time, the tree at hand goes on as far
as it can by itself; it is replaced between two ticks, and what runs and is still needed runs on.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Collection, Mapping
from dataclasses import replace

from nondum.host.core.events.event import Emit
from nondum.host.core.events.goals import GoalEnded, PlanMade, PlanMissing
from nondum.host.core.records.component import ComponentState
from nondum.host.mind import short_names
from nondum.host.mind.announcements import People, kept_out
from nondum.host.mind.beliefs import Beliefs
from nondum.host.mind.composition import Composition
from nondum.host.mind.conclusions import Conclusions
from nondum.host.mind.diagnosis import Seen, seen_in
from nondum.host.mind.exclusions import Exclusions
from nondum.host.mind.goals import GivenGoal, GoalQueue, GoalState, is_replaced
from nondum.host.mind.kept_plans import kept, still_works
from nondum.host.mind.planners import Planners
from nondum.host.mind.pursued import Pursued, conflicts
from nondum.host.mind.pursued_goals import PursuedGoals, each_once
from nondum.host.mind.running_search import RunningSearch
from nondum.host.mind.search import search
from nondum.host.mind.search_order import Turns
from nondum.host.mind.situation import NoPlan, Past, Planned, Situation, Waits
from nondum.host.mind.situations import Situations
from nondum.planning.execute.attempts import Attempts, Patience
from nondum.planning.execute.independence import Reservation
from nondum.planning.execute.plan_executive import Phase
from nondum.planning.execute.running import Run, RunningLeaves
from nondum.planning.execute.task_tree import TaskTree
from nondum.sdk.errors import Problem
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
        self.pursued = PursuedGoals(queue)
        """The goals that are pursued now."""
        self._beliefs = beliefs
        self._leaves = leaves
        self._planners = planners
        self._people = people
        self._emit = emit
        self._now_s = now_s
        self._deadline_s = deadline_s
        self._patience = patience
        self._composition: Composition | None = None
        self._seen: tuple[Seen, ...] = ()
        self._left_out: dict[str, Problem] = {}
        self._search = RunningSearch(wake)
        self._tried: dict[int, Situation] = {}
        """By the number of a goal: one that is given again under its id was not tried yet."""
        self._turns = Turns()
        self.exclusions = Exclusions(now_s)
        """The actions that are not planned with for now."""
        self._situations = Situations(queue, beliefs, self.pursued, self.exclusions)
        self._conclusions = Conclusions(queue, beliefs, people, emit, now_s)

    @property
    def seen(self) -> tuple[Seen, ...]:
        """The components that were here, as far as they are remembered."""
        return self._seen

    @property
    def left_out(self) -> tuple[tuple[str, Problem], ...]:
        """The components that are not planned with, for they have too many ways to act."""
        return tuple(sorted(self._left_out.items()))

    @property
    def troubles(self) -> dict[str, str]:
        """Actions that fail and are tried again, or are left out for it, and how they failed."""
        controls = [one.tree.control for one in self.pursued]
        well = {name for control in controls for name in control.proven(self._now_s())}
        attempts = [control.attempts for control in controls]
        attempts = attempts or [Attempts(self._patience, self.exclusions.setbacks)]
        return {
            name: why
            for one in attempts
            for name in one.troubled()
            if name not in well and (why := one.trouble(name))
        }

    @property
    def is_searching(self) -> bool:
        """Whether a plan is being searched for."""
        return self._search.is_running

    # Between ticks

    def step(self) -> None:
        """Draw the conclusions of the last tick, and see to plans for what is wanted."""
        self.pursued.forget_ended()
        for one in self.pursued:
            if self._conclusions.draw(one):
                self.pursued.drop("the goal is reached", one.goal)
        self._take_found()
        if self._composition is None:
            return
        self.pursued.drop_ended("its goal is over")
        while (goal := self._next()) is not None:
            if not self._is_searched_for(goal):
                self._start_search(goal)
            if self._search.is_running:
                return
        self._search.cancel()

    def adopt(self, composition: Composition) -> None:
        """Go on with the plan in a new composition if it still works there."""
        before = self._composition.contributions if self._composition else ()
        if not set(before) <= set(composition.contributions):  # what is left may be small enough
            self._note_left_out({})
        if self._composition is None or _parts(self._composition) != _parts(composition):
            self.exclusions.clear()
        self._turns.restart()
        self._composition = composition
        self._seen = seen_in(composition.snapshot)
        for one in self.pursued:
            situation, believed = self._situation(one.goal), self._beliefs.world.facts
            plan = kept(composition, self.queue[one.goal], one, situation, believed)
            if plan is None:
                one.is_outdated = True
            else:
                self._grow(one.goal, *plan, phase=one.phase)
        outdated = conflicts(self.pursued)
        for one in self.pursued:
            if one.goal in outdated:
                one.is_outdated = True

    async def close(self) -> None:
        """Stop searching and pursuing."""
        self.pursued.drop("the host is stopping")
        await self._search.close()

    # Searching

    def _situation(self, goal: str) -> Situation:
        revision = self._composition.revision if self._composition else 0
        return self._situations.of(goal, revision)

    def _is_on_its_way(self, goal: GivenGoal) -> bool:
        """Whether a goal has a plan that goes on, or nothing new is known since none was found."""
        if one := self.pursued.of(goal.id):
            self.exclusions.note(one.tree.control)
            return not one.is_outdated and one.tree.needs_replan is None
        tried = self._tried.get(goal.number)
        if tried is None:
            return False
        now = self._situation(goal.id)
        return tried == now if goal.state is GoalState.SUSPENDED else tried.is_like(now)

    def _next(self) -> GivenGoal | None:
        due = [goal for goal in self.queue.open() if not self._is_on_its_way(goal)]
        searched = next(filter(self._is_searched_for, due), None)
        return self._turns.next(due, searched, self.pursued)

    def _is_searched_for(self, goal: GivenGoal) -> bool:
        return self._search.is_for(self._situation(goal.id))

    def _start_search(self, wanted: GivenGoal) -> None:
        assert self._composition is not None  # `step` waits for one
        situation = self._situation(wanted.id)
        if self._tried.get(wanted.number) == situation:
            self._give_up_plan(wanted)
            return
        self._search.start(
            situation,
            search(
                self._planners,
                self._composition,
                wanted,
                situation,
                deadline_s=self._deadline_s,
                past=Past(self.seen, self.exclusions.all_failures, dict(self._left_out)),
            ),
        )

    def _give_up_plan(self, wanted: GivenGoal) -> None:
        """The plan at hand is stuck, and nothing new is known that another could be made of."""
        one = self.pursued.of(wanted.id)
        why = one.tree.needs_replan if one else None
        problem = Problem("PLAN_STUCK", why or "its plan does not go on", where=f"goal {wanted.id}")
        self._suspend(NoPlan(self._situation(wanted.id), (problem,)))

    def _take_found(self) -> None:
        found = self._search.take()
        if found is None:
            return
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

    def _still_works(self, found: Planned) -> bool:
        assert self._composition is not None  # there was a search
        beside = {other.goal for other in found.beside}
        going_on = [one for one in self.pursued if one.goal in beside]
        believed = self._situations.facts_beside.of(going_on)
        return still_works(self._composition, found, believed)

    def _suspend(self, found: NoPlan) -> None:
        goal = self.queue[found.situation.goal]
        self._tried[goal.number] = found.situation
        self.pursued.drop("there is no plan any more", goal.id)
        if goal.state is not GoalState.SUSPENDED or goal.problems != found.problems:
            words = "; ".join(problem.message for problem in found.problems)
            fixes = "; ".join(problem.fix for problem in found.problems if problem.fix)
            self._people.tell(f"cannot {goal.text!r} now: {words}{f' → {fixes}' if fixes else ''}")
            self._emit(PlanMissing(goal.id, found.problems))
        reason = found.problems[0].message
        self.queue.put(goal.id, GoalState.SUSPENDED, reason, found.problems, found.needs)

    def _wait(self, found: Waits) -> None:
        goal = self.queue[found.situation.goal]
        self.pursued.drop("more urgent goals need what it uses", goal.id)
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
            runs = self.pursued.release(id)
            if runs is not None:
                handed_over += runs
                self._tried.pop(self.queue[id].number, None)  # it is put aside, not given up
                self._put_aside(id, goal.id, shared)
        # Without those that it put aside the answer is the same.
        others = self._situations.other_plans(goal.id)
        self._tried[goal.number] = replace(found.situation, others=others)
        self.queue.put(goal.id, GoalState.ACTIVE)
        self._grow(goal.id, found.task, found.plan, runs=handed_over)
        called = short_names.steps(found.names, {})
        steps = ", then ".join(called.values()) or "nothing to do"
        because = f", because {reason}" if reason else ""
        self._people.tell(f"plan for {goal.text!r}{because}: {steps}")
        self._emit(PlanMade(goal.id, found.situation.revision, found.names, reason))

    def _why_another_plan(self, goal: str) -> str:
        one = self.pursued.of(goal)
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
        before = self.pursued.of(id)
        # Units may not be free before what is halted has ended.
        halting = [run for run in self.pursued.runs if run.is_halting]
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
            runs=each_once((*own, *runs, *halting)),
            patience=self._patience,
            setbacks=self.exclusions.setbacks,
            name=f"goal {goal.id}",
        )
        left = tree.control.regression
        reservation = Reservation.of(id, left.steps, left.goal, exclusive)
        self.pursued.put(Pursued(id, task, plan, tree, reservation, phase=phase))


_WAITS = {GoalState.QUEUED: "", GoalState.HALTED: "is "}


def _parts(composition: Composition) -> tuple[object, ...]:
    """What an action's failure may come from: who is here, with which devices and data, and where
    units sit. Workers that are started again by themselves change nothing of that."""
    snapshot, given_up = composition.snapshot, ComponentState.QUARANTINED
    own = ((c.id, c.devices, c.data, c.state is given_up) for c in snapshot.components)
    return (*composition.contributions, *own, *snapshot.mounts)

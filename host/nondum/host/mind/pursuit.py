"""The pursuit of goals: which one, by which plan, and what happens when the world says otherwise.

One goal is pursued at a time. While another plan is searched for, the tree at hand goes on as far
as it can by itself; it is replaced between two ticks, and what runs and is still needed runs on.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from nondum.host.catalogue.records import ComponentState
from nondum.host.events import Emit, GoalEnded, GoalReached, PlanMade, PlanMissing
from nondum.host.mind import short_names
from nondum.host.mind.beliefs import Beliefs
from nondum.host.mind.composition import Composition
from nondum.host.mind.diagnosis import Seen, seen_in
from nondum.host.mind.goals import GivenGoal, GoalQueue, GoalState
from nondum.host.mind.people import People
from nondum.host.mind.planners import Planners
from nondum.host.mind.runner import BehaviourRunner
from nondum.host.mind.search import NoPlan, Past, Planned, Situation, search, task_of
from nondum.planning.attempts import Attempts, Patience, Setbacks
from nondum.planning.goal import parse_goal
from nondum.planning.plain import plain
from nondum.planning.replay import beginning_at, replayed
from nondum.planning.running import Run
from nondum.planning.task_control import Phase, TaskControl
from nondum.planning.task_tree import TaskTree
from nondum.sdk.errors import FragmentRefused, GoalRefused, Problem
from nondum.sdk.planner import GroundTask, Plan

log = logging.getLogger(__name__)


@dataclass(slots=True)
class Current:
    """The goal that is being pursued, and how."""

    goal: str
    """Its id."""
    task: GroundTask
    plan: Plan
    tree: TaskTree
    is_outdated: bool = False
    """The plan does not fit the components that are here now."""
    phase: Phase = Phase.UNDER_WAY
    """As people were last told."""
    trouble: str = ""
    """What is tried again, and why, as the goal's reason was last said to be."""

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the plan's actions."""
        return tuple(self.task.actions[step].name for step in self.plan.steps)


class Pursuit:
    """Keeps the most urgent goal that can be had in a task tree."""

    def __init__(
        self,
        *,
        queue: GoalQueue,
        beliefs: Beliefs,
        runner: BehaviourRunner,
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
        self.current: Current | None = None
        self._beliefs = beliefs
        self._runner = runner
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
        self._search: asyncio.Task[Planned | NoPlan] | None = None
        self._searched_for: Situation | None = None
        self._tried: dict[int, Situation] = {}
        """By the number of a goal: one that is given again under its id was not tried yet."""
        self._excluded_until_s: dict[str, float] = {}
        self.setbacks = Setbacks()
        self._left_over: tuple[Run, ...] = ()

    @property
    def tree(self) -> TaskTree | None:
        """The task tree to tick, if a goal is pursued."""
        return self.current.tree if self.current else None

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
        current = tuple(self.current.tree.control.runs.values()) if self.current else ()
        return (*current, *self._left_over)

    @property
    def failures(self) -> dict[str, str]:
        """The actions that are excluded, and how they failed."""
        return {name: self._failures.get(name, "") for name in sorted(self.excluded)}

    @property
    def troubles(self) -> dict[str, str]:
        """Actions that fail and are tried again, or are left out for it, and how they failed."""
        control = self.current.tree.control if self.current else None
        attempts = control.attempts if control else Attempts(self._patience, self.setbacks)
        well = control.steady(self._now_s()) if control else ()
        failing = (name for name in attempts.troubled() if name not in well)
        return {name: why for name in failing if (why := attempts.trouble(name))}

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
        """Draw the conclusions of the last tick, and see to a plan for what is wanted most."""
        self._left_over = tuple(r for r in self._left_over if not r.action.state.has_ended)
        self._conclude()
        self._take_found()
        if self._composition is None:
            return
        wanted = self.queue.wanted(lambda g: self._tried.get(g.number) != self._situation(g.id))
        if self.current and (wanted is None or self.queue[self.current.goal].state.is_final):
            self.drop("its goal is over")
        if wanted is None:
            self._cancel_search()
        elif not self._is_on_its_way(wanted):
            self._start_search(wanted)

    def adopt(self, composition: Composition) -> None:
        """Go on with the plan in a new composition if it still works there."""
        before = self._composition.contributions if self._composition else ()
        if not set(before) <= set(composition.contributions):  # what is left may be small enough
            self._left_out.clear()
        if self._composition is None or _parts(self._composition) != _parts(composition):
            self._excluded_until_s.clear()  # what it failed for may be another now
            self.setbacks.clear()
        self._composition = composition
        self._seen = seen_in(composition.snapshot)
        current = self.current
        if current is None:
            return
        kept = self._replayed(composition, current)
        if kept is None:
            current.is_outdated = True
        else:
            self._grow(current.goal, *kept, phase=current.phase)

    def drop(self, because: str) -> None:
        """Stop pursuing: everything that runs is halted."""
        if self.current is not None:
            self.current.tree.halt(because)
            self._left_over += self.current.tree.release()
            self.current = None

    async def close(self) -> None:
        """Stop searching and pursuing."""
        self.drop("the host is stopping")
        if self._search is not None:
            self._search.cancel()
            await asyncio.gather(self._search, return_exceptions=True)

    # What the last tick came to

    def _conclude(self) -> None:
        current = self.current
        if current is None or not current.tree.control.decisions:  # not ticked yet
            return
        control = current.tree.control
        phase = control.phase
        if phase is not current.phase:
            current.phase, current.trouble = phase, ""
            self._tell_phase(current, phase)
        for name in control.steady(self._now_s()):
            control.attempts.effective(name)
        if phase is Phase.UNDER_WAY and (trouble := control.trouble()) != current.trouble:
            current.trouble = trouble
            self.queue.put(current.goal, GoalState.ACTIVE, trouble)
        if phase is Phase.REACHED:
            self.queue.put(current.goal, GoalState.REACHED, "it holds")
            self._emit(GoalReached(current.goal))
            self.drop("the goal is reached")

    def _tell_phase(self, current: Current, phase: Phase) -> None:
        goal = self.queue[current.goal]
        if phase is Phase.REACHED:
            self._people.tell(f"goal {goal.id} is reached: {goal.text}")
        elif phase is Phase.HOLDING:
            self.queue.put(goal.id, GoalState.ACTIVE, "it holds and is kept so")
            self._people.tell(f"goal {goal.id} holds and is kept so: {goal.text}")
        elif phase is Phase.UNDER_WAY:
            self.queue.put(goal.id, GoalState.ACTIVE, "")
        elif why := current.tree.needs_replan:
            self.queue.put(goal.id, GoalState.ACTIVE, f"another plan is needed: {why}")
            self._people.tell(f"goal {goal.id} needs another plan: {why}")

    # Searching

    def _situation(self, goal: str) -> Situation:
        revision = self._composition.revision if self._composition else 0
        return Situation(goal, revision, self._beliefs.world.bare_facts, self.excluded)

    def _is_on_its_way(self, wanted: GivenGoal) -> bool:
        """Whether a goal has a plan that goes on, or will have one soon."""
        current = self.current
        if current is not None and current.goal == wanted.id:
            self._exclude(current.tree.control)
            if not current.is_outdated and current.tree.needs_replan is None:
                self._cancel_search()
                return True
        return self._searched_for is not None and self._searched_for.is_like(
            self._situation(wanted.id)
        )

    def _exclude(self, control: TaskControl) -> None:
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
        why = self.current.tree.needs_replan if self.current else None
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
        elif self._still_works(found):
            self._take_up(found)
        else:
            del self._tried[number]  # the world has moved on; `step` searches again

    def _note_left_out(self, left_out: Mapping[str, Problem]) -> None:
        for component, problem in left_out.items():
            if component not in self._left_out:
                self._people.tell(f"{component} is kept out of planning: {problem}")
        self._left_out = dict(left_out)

    def _outcome(
        self, search: asyncio.Task[Planned | NoPlan], asked: Situation
    ) -> Planned | NoPlan:
        """What a search came to; a fault in planning is contained, and told like a missing plan."""
        error = search.exception()
        if error is None:
            return search.result()
        log.error("a search for a plan failed", exc_info=error)
        problem = Problem("PLANNING_FAULT", f"planning failed: {type(error).__name__}: {error}")
        return NoPlan(asked, (problem,))

    def _still_works(self, found: Planned) -> bool:
        assert self._composition is not None  # there was a search
        lasting, believed = self._composition.merged.lasting(), self._beliefs.world.bare_facts
        return replayed(found.task, found.names, believed, lasting) is not None

    def _suspend(self, found: NoPlan) -> None:
        goal = self.queue[found.situation.goal]
        self._tried[goal.number] = found.situation
        if self.current is not None and self.current.goal == goal.id:
            self.drop("there is no plan any more")
        if goal.state is not GoalState.SUSPENDED or goal.problems != found.problems:
            words = "; ".join(problem.message for problem in found.problems)
            fixes = "; ".join(problem.fix for problem in found.problems if problem.fix)
            self._people.tell(f"cannot {goal.text!r} now: {words}{f' → {fixes}' if fixes else ''}")
            self._emit(PlanMissing(goal.id, found.problems))
        reason = found.problems[0].message
        self.queue.put(goal.id, GoalState.SUSPENDED, reason, found.problems)

    # Taking up a plan

    def _take_up(self, found: Planned) -> None:
        goal = self.queue[found.situation.goal]
        reason = self._why_another_plan(goal.id)
        if self.current is not None and self.current.goal != goal.id:
            put_aside = self.queue[self.current.goal].number
            self._tried.pop(put_aside, None)  # it is put aside, not given up
        for replaced in self.queue.activate(goal.id):
            self._people.tell(f"goal {replaced.id} is {replaced.reason}: {replaced.text}")
            self._emit(GoalEnded(replaced.id, replaced.reason))
        self._grow(goal.id, found.task, found.plan)
        called = short_names.steps(found.names, {})
        steps = ", then ".join(called.values()) or "nothing to do"
        because = f", because {reason}" if reason else ""
        self._people.tell(f"plan for {goal.text!r}{because}: {steps}")
        self._emit(PlanMade(goal.id, found.situation.revision, found.names, reason))

    def _why_another_plan(self, goal: str) -> str:
        if self.current is None or self.current.goal != goal:
            return ""
        return self.current.tree.needs_replan or "the components changed"

    def _grow(
        self, id: str, task: GroundTask, plan: Plan, *, phase: Phase = Phase.UNDER_WAY
    ) -> None:
        """Put the tree of a plan in the place of the present one."""
        assert self._composition is not None  # there is a task
        runs = self.current.tree.release() if self.current else ()
        goal = self.queue[id]
        tree = TaskTree(
            task,
            plan,
            lasting=self._composition.merged.lasting(),
            runner=self._runner,
            kind=goal.kind,
            sight=lambda: (self._beliefs.world, self._now_s()),
            exclusive=self._composition.exclusive,
            runs=(*runs, *self._left_over),
            patience=self._patience,
            setbacks=self.setbacks,
            name=f"goal {goal.id}",
        )
        self._left_over = ()
        self.current = Current(goal.id, task, plan, tree, phase=phase)

    def _replayed(
        self, composition: Composition, current: Current
    ) -> tuple[GroundTask, Plan] | None:
        """The plan in the new composition, if what is left of it still reaches the goal there."""
        given = self.queue[current.goal]
        try:
            goal = parse_goal(given.pddl, composition.merged, kind=given.kind)
        except GoalRefused:
            return None
        try:
            task = task_of(composition, goal, self._situation(current.goal))
        except FragmentRefused:  # too many ways: the plan at hand goes on, guarded as before
            task = current.task
        believed = self._beliefs.world.facts
        plan = replayed(task, current.names, believed, composition.merged.lasting())
        return None if plan is None else plain(beginning_at(task, believed), plan)


def _parts(composition: Composition) -> tuple[object, ...]:
    """What an action's failure may come from: who is here, with which devices, and where units sit.
    Workers that are started again by themselves change nothing of that."""
    snapshot, given_up = composition.snapshot, ComponentState.QUARANTINED
    own = ((c.id, c.devices, c.state is given_up) for c in snapshot.components)
    return (*composition.contributions, *own, *snapshot.mounts)

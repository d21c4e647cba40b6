"""The mind of a host: it believes, wants, plans and acts, one short tick at a time.

Events and snapshots of the catalogue come in between ticks; `run` ticks the system tree when there
is news, and at a steady pace. Nothing here blocks the loop.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import time
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from py_trees.behaviour import Behaviour

from nondum.host.core.events.event import Emit, Event
from nondum.host.core.events.goals import GoalEnded, GoalGiven
from nondum.host.core.names import shortened
from nondum.host.core.records.goal import GoalRecord
from nondum.host.core.records.snapshot import Snapshot
from nondum.host.mind.announcements import People, kept_out, recomposed
from nondum.host.mind.beliefs import Beliefs
from nondum.host.mind.component_leaf import ComponentLeaf
from nondum.host.mind.component_plugins import Ask, ComponentPlugins, no_answer
from nondum.host.mind.component_step import component_step
from nondum.host.mind.composition import Composition, compose
from nondum.host.mind.goals import GivenGoal, GoalQueue, GoalState
from nondum.host.mind.halted import Halts
from nondum.host.mind.planners import Planners
from nondum.host.mind.pursuit import Pursuit
from nondum.host.mind.runner import BehaviourRunner, Calls
from nondum.host.mind.search import SMALL
from nondum.host.mind.short_names import short_names
from nondum.host.mind.system_tree import Duty, Hold, Parts, SystemTree, TaskSlot, default_tree
from nondum.host.mind.views import Views
from nondum.planning.execute.attempts import Patience
from nondum.planning.execute.running import RunningLeaves
from nondum.planning.execute.step import Step
from nondum.planning.merge.contribution import Contribution
from nondum.planning.merge.domain import bind
from nondum.planning.merge.goal import Goal, GoalKind, goal_text, parse_goal
from nondum.sdk.errors import GoalRefused, Problem

log = logging.getLogger(__name__)

BUSY_S = 0.05
"""Time between ticks while a task runs."""
IDLE_S = 1.0
"""Time between ticks while nothing is asked for."""
PAUSE_S = 0.005
"""Between two ticks, however much news there is: a plugin that floods costs no more than this."""


class Mind:
    """Composed by the host: `see` snapshots, `on_event`, `run`; then `close`."""

    def __init__(
        self,
        host: str,
        calls: Calls,
        planners: Planners,
        *,
        emit: Emit,
        ask: Ask = no_answer,
        deadline_s: float = 10.0,
        patience: Patience | None = None,
        system_tree: SystemTree = default_tree,
        now_s: Callable[[], float] = time.monotonic,
        wall_s: Callable[[], float] = time.time,
    ) -> None:
        """`emit` is told of goals and plans; `ask` asks a component's worker for an acting hook;
        `deadline_s` bounds a search for a plan, `patience` what behaviours are waited for."""
        self.plugins = ComponentPlugins(ask)
        self.beliefs = Beliefs(host, now_s)
        self.queue = GoalQueue()
        self.names: Mapping[str, str] = {}
        """Whole names of units and streams → short ones; also of those that have just gone."""
        self.people = People(wall_s, lambda text: shortened(text, self.names))
        self.runner = BehaviourRunner(calls, self.beliefs, now_s)
        self.leaves = RunningLeaves(self.runner, now_s)
        self.composition: Composition | None = None
        self.version = 0
        """Rises whenever a view may look different."""
        self.ticks = 0
        """How often the system tree was ticked."""
        self._calls, self._planners, self._emit = calls, planners, emit
        self._halts, self._news = Halts(), asyncio.Event()
        self._afterwards: list[Callable[[], None]] = []
        self._viewers = asyncio.Condition()
        self._composing: asyncio.Task[Composition | str] | None = None
        self._told_version: tuple[object, ...] = ()
        self.pursuit = self._make_pursuit(now_s, deadline_s, patience or Patience())
        self.root: Behaviour = system_tree(self._parts())
        self.views = Views(self, now_s=now_s, wall_s=wall_s)

    def _make_pursuit(
        self, now_s: Callable[[], float], deadline_s: float, patience: Patience
    ) -> Pursuit:
        return Pursuit(
            queue=self.queue,
            beliefs=self.beliefs,
            leaves=self.leaves,
            planners=self._planners,
            people=self.people,
            emit=self._emit,
            now_s=now_s,
            deadline_s=deadline_s,
            patience=patience,
            wake=self.wake,
        )

    # News

    def see(self, snapshot: Snapshot) -> None:
        """Take over a new revision of the catalogue: what is gone is withdrawn at once, what is new
        is planned with from the next tick on."""
        gone, new = self.beliefs.see(snapshot)
        for component in gone:
            self.runner.lose(component)
        for component in new:
            for claim in self._calls.claims(component):
                self.on_event(claim)
        if self._composing is not None:
            self._composing.cancel()
            self._composing = None
        self.plugins.see(snapshot)
        contributions = self.plugins.contributions()
        if len(contributions) > SMALL:
            merging = asyncio.to_thread(composed, snapshot, contributions)
            self._composing = asyncio.create_task(merging)
            self._composing.add_done_callback(lambda _: self.wake())
        else:
            self._adopt(composed(snapshot, contributions))
        self.wake()

    def on_event(self, event: Event) -> None:
        """Take in what a worker or the component manager tells."""
        was_belief = self.beliefs.on_event(event)  # first: the runner passes new values on
        if self.runner.on_event(event) or was_belief:
            self.wake()

    def wake(self) -> None:
        """Ask for a tick."""
        self._news.set()

    def after_tick(self, do: Callable[[], None]) -> None:
        """Do something once, after the next tick: what cannot go on has been asked to halt then."""
        self._afterwards.append(do)

    # Goals

    def give(
        self,
        *,
        words: str | None = None,
        pddl: str | None = None,
        kind: GoalKind | None = None,
        priority: int = 0,
        said: str | None = None,
        id: str = "",
    ) -> GivenGoal:
        """Want something, in words or in PDDL; `said` are words that the PDDL was understood from,
        `id` is its id if it is to have a given one.

        Raises `GoalRefused`.
        """
        goal = self._understood(words, pddl, kind)
        text = words or said or goal.text
        if goal.kind == "do":
            self.beliefs.world.withdraw_effects(bind(atom, {}) for atom in goal.expr.positive)
        given = self.queue.give(text, goal_text(goal.expr), goal.kind, priority=priority, id=id)
        self._emit(GoalGiven(given.id, given.text, given.kind, given.pddl, priority))
        self.wake()
        return given

    def keep(self, words: str, *, priority: int = 0, reason: str = "") -> GivenGoal:
        """Keep words that mean nothing yet, as a goal that can be halted like any other.

        The caller gives them under their id once they mean something.
        """
        given = self.queue.keep(words, priority=priority, reason=reason)
        self.people.tell(f"{words!r} is kept until it means something: that is goal {given.id}")
        self.wake()
        return given

    def resume(self, id: str) -> GivenGoal:
        """Take up a halted goal again, under its id, as the newest.

        Raises `GoalRefused` (GOAL_UNKNOWN, GOAL_NOT_HALTED, or as when it is given).
        """
        goal = self.queue[id]
        if not goal.is_resumable:
            told = f"goal {id} is {goal.state.value}"
            known = ", ".join(one.id for one in self.queue if one.is_resumable) or "none"
            fix = f"goals that can be resumed: {known}"
            raise GoalRefused(Problem("GOAL_NOT_HALTED", told, where=goal.text, fix=fix))
        if not goal.pddl:  # it was kept, and has never meant anything
            return self.give(words=goal.text, priority=goal.priority, id=id)
        return self.give(
            pddl=goal.pddl, kind=goal.kind, priority=goal.priority, said=goal.text, id=id
        )

    def restore(self, goals: Iterable[GoalRecord]) -> None:
        """Go on with what an earlier run of the host had not done."""
        for goal in self.queue.restore(goals):
            self.people.tell(f"goal {goal.id} is taken up again: {goal.text}")
        self.wake()

    def halt(
        self, *, id: str | None = None, now: bool = False, why: str = "halted by a person"
    ) -> tuple[str, ...]:
        """Halt a goal, or all of them; with `now` every behaviour that runs is halted directly.
        `why` is what is said of it.

        Gives the names of what was asked to end. Needs no planner. Raises `GoalRefused`
        (GOAL_UNKNOWN).
        """
        goals = [self.queue[id]] if id is not None else list(self.queue)
        for goal in goals:
            if not goal.state.is_final:
                self.queue.put(goal.id, GoalState.HALTED, why)
                self._emit(GoalEnded(goal.id, why))
                self.people.tell(f"goal {goal.id} is halted: {goal.text}")
        if now:
            running = tuple(run.step.name for run in self.runner)
            self.pursuit.pursued.drop(why)
            self.runner.halt_all()
        else:
            running = self.pursuit.pursued.drop_ended(why)
        self.wake()
        return running

    # Ticking

    def tick(self) -> None:
        """Tick the system tree once."""
        self.ticks += 1
        self.root.tick_once()
        if (halts := self._halts.after(self.ticks, self.pursuit.pursued.runs)) is not None:
            self._emit(halts)

    async def run(self) -> None:
        """Tick until cancelled: when there is news, at once or `PAUSE_S` after the last tick; else
        every `BUSY_S` or `IDLE_S`."""
        warming = asyncio.create_task(self._planners.warm())
        loop = asyncio.get_running_loop()
        try:
            while True:
                self._news.clear()
                earliest_s = loop.time() + PAUSE_S
                self._tick_safely()
                self._halt_unticked()
                afterwards, self._afterwards = self._afterwards, []
                for do in afterwards:
                    do()
                if self._may_look_different():
                    async with self._viewers:
                        self._viewers.notify_all()
                is_busy = self.pursuit.pursued or self.leaves
                with contextlib.suppress(TimeoutError):
                    async with asyncio.timeout(BUSY_S if is_busy else IDLE_S):
                        await self._news.wait()
                await asyncio.sleep(max(0.0, earliest_s - loop.time()))
        finally:
            warming.cancel()
            await asyncio.gather(warming, return_exceptions=True)

    async def changed(self, since: int) -> int:
        """Wait until `version` is not `since`, and give it: then views may look different."""
        async with self._viewers:
            await self._viewers.wait_for(lambda: self.version != since)
        return self.version

    async def close(self) -> None:
        """Halt all that runs and end the planners; what is wanted is still wanted."""
        await self.pursuit.close()
        self.runner.halt_all()
        if self._composing is not None:
            self._composing.cancel()
            await asyncio.gather(self._composing, return_exceptions=True)
        await self._planners.close()

    def _halt_unticked(self) -> None:
        """Halt what a tree has started and no tree ticks any more."""
        for step in self.leaves.expire():
            self.people.tell(f"{step.name} is halted: no behaviour tree ticks it any more")

    def _tick_safely(self) -> None:
        """A fault in a tick, most likely of an integrator's own leaf, stops the robot, not the
        host."""
        try:
            self.tick()
        except Exception as error:
            log.exception("a tick of the system tree failed")
            self.runner.halt_all()
            self.people.tell(f"the system tree failed: {type(error).__name__}: {error}")

    # Parts of the system tree

    def _parts(self) -> Parts:
        return Parts(
            monitor=Duty("monitor", self._monitor),
            world_model=Duty("world model", self._believe),
            goals=Duty("goals", self._choose),
            task=TaskSlot(lambda: self.pursuit.pursued.trees, Hold(self._waits_for)),
            people=Duty("people", lambda: f"{self.people.last_number} sentences told"),
            behaviour=self._behaviour_leaf,
            facts=lambda: self.beliefs.world.facts,
        )

    def _behaviour_leaf(self, behaviour: str, *, of: str, **arguments: str) -> Behaviour:
        def step() -> Step:
            if self.composition is None:
                raise _too_early()
            facts = self.beliefs.world.facts
            return component_step(self.composition, facts, behaviour, of, arguments)

        return ComponentLeaf(of, behaviour, step, self.leaves)

    def _monitor(self) -> str:
        if self._composing is not None and self._composing.done():
            composing, self._composing = self._composing, None
            self._adopt(composing.result())
        revision = self.composition.revision if self.composition else 0
        return f"revision {revision}{', another is being merged' if self._composing else ''}"

    def _adopt(self, composition: Composition | str) -> None:
        if isinstance(composition, str):
            self.people.tell(f"planning stays as it was: {composition}")
            return
        old, self.composition = self.composition, composition
        names = short_names(composition.merged.objects)
        before = short_names(old.merged.objects) if old else {}
        taken = {*names.values(), *composition.merged.objects}
        gone = {whole: short for whole, short in before.items() if short not in taken}
        self.names = {**gone, **names}
        self.beliefs.adopt(composition)
        self.runner.adopt(composition)
        self.pursuit.adopt(composition)
        for sentence in recomposed(old, composition):
            self.people.tell(sentence)
        kept_out(self.people, old.merged.quarantined if old else {}, composition.merged.quarantined)

    def _believe(self) -> str:
        for problem in self.beliefs.new_conflicts():
            self.people.tell(str(problem))
        facts = len(self.beliefs.world.facts)
        return "1 fact holds" if facts == 1 else f"{facts} facts hold"

    def _choose(self) -> str:
        self.pursuit.step()
        goals = (self.queue[one.goal] for one in self.pursuit.pursued)
        return "; ".join(f"goal {goal.id}: {goal.text}" for goal in goals)

    def _waits_for(self) -> str:
        if self.pursuit.is_searching:
            return "a plan is being searched for"
        if self.pursuit.pursued:
            return "another plan is needed"
        open_goals = [goal for goal in self.queue if not goal.state.is_final]
        return "; ".join(f"goal {g.id} is {g.state.value}: {g.reason}" for g in open_goals)

    def _understood(self, words: str | None, pddl: str | None, kind: GoalKind | None) -> Goal:
        if (words is None) == (pddl is None):
            raise ValueError("a goal is given in words or in PDDL")
        if self.composition is None:
            raise _too_early()
        if words is not None:
            return self.composition.book.goal(words)
        assert pddl is not None  # the other way to give one
        return parse_goal(pddl, self.composition.merged, kind=kind or "achieve")

    def _may_look_different(self) -> bool:
        seen: tuple[Any, ...] = (
            self.beliefs.world.revision,
            self.people.last_number,
            self.composition.revision if self.composition else 0,
            tuple((node.id, node.status) for node in self.root.iterate()),
            tuple((run.step.name, run.state, run.progress) for run in self.runner),
            tuple((goal.id, goal.state, goal.reason) for goal in self.queue),
        )
        if seen == self._told_version:
            return False
        self._told_version = seen
        self.version += 1
        return True


def _too_early() -> GoalRefused:
    text = "the host does not know itself yet"
    return GoalRefused(Problem("GOAL_TOO_EARLY", text, fix="ask again in a second"))


def composed(snapshot: Snapshot, contributions: tuple[Contribution, ...]) -> Composition | str:
    """The composition of a snapshot, or the fault that merging ran into: strangers' words must not
    stop the host."""
    try:
        return compose(snapshot, contributions)
    except Exception as error:
        log.exception("revision %d cannot be merged", snapshot.revision)
        return f"merging failed with {type(error).__name__}: {error}"

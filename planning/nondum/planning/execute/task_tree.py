"""The task tree: a plan as a py_trees composite, one leaf for each step.

The executive decides (see `plan_executive`), and the leaves act: a step's leaf starts its behaviour
when it is first ticked, reports how far it is, and halts it when it is stopped. The composite is
ticked like any other node: SUCCESS once an achieve goal is reached, RUNNING while it is under way
or a maintain goal is held, FAILURE while it is stuck (then `needs_replan` says why). Being
interrupted halts everything that it runs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import TypeAlias

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Composite

from nondum.planning.execute.attempts import Patience, Setbacks
from nondum.planning.execute.partial_order import bits
from nondum.planning.execute.plan_executive import Phase, PlanExecutive
from nondum.planning.execute.regression import Regression
from nondum.planning.execute.running import Run, RunningLeaves, World
from nondum.planning.execute.step import Step, steps_of, words
from nondum.planning.execute.step_status import StepStatus, step_status
from nondum.planning.merge.goal import GoalKind
from nondum.sdk.planner import GroundTask, Plan

Sight: TypeAlias = Callable[[], tuple[World, float]]
"""What is believed now, and the time in seconds; asked once a tick."""

_STATUS = {
    Phase.UNDER_WAY: Status.RUNNING,
    Phase.HOLDING: Status.RUNNING,
    Phase.REACHED: Status.SUCCESS,
    Phase.STUCK: Status.FAILURE,
}


class RunLeaf(Behaviour):
    """A leaf that starts and halts the run that the executive has made of its step: the run goes on
    exactly while the leaf is RUNNING."""

    def __init__(self, control: PlanExecutive, step: Step, leaves: RunningLeaves) -> None:
        super().__init__(step.name)
        self.step = step
        self.control = control
        self._leaves = leaves

    @property
    def run(self) -> Run | None:
        """The run of its step, if there is one."""
        return self.control.runs.get(self.step.name)

    @property
    def is_to_run(self) -> bool:
        """Whether it has a run that is to go on."""
        return (run := self.run) is not None and not run.is_halting

    @property
    def has_another_run(self) -> bool:
        """Whether it shows a run that has ended, while another one is to be started."""
        run = self.run
        return self.status is Status.RUNNING and run is not None and not run.is_started

    def initialise(self) -> None:
        """Start the run, or go on with one that another leaf has started."""
        run = self.run
        if run is not None and not run.is_halting and not run.is_started:
            run.action = self._leaves.start(self.step)

    def update(self) -> Status:
        """RUNNING while its run goes on; after that, what the executive makes of the step."""
        run = self.run
        if run is None or run.is_halting:
            return self.at_rest()
        self._leaves.tick(self.step, run.action)
        return Status.RUNNING

    def at_rest(self) -> Status:
        """The status while nothing runs: SUCCESS, nothing is left to do."""
        return Status.SUCCESS

    def terminate(self, new_status: Status) -> None:
        """Halt its run where the leaf is interrupted."""
        if new_status is Status.INVALID and (run := self.run) is not None:
            run.halt("the task was interrupted")
            run.action.halt()


class StepLeaf(RunLeaf):
    """A step of the plan."""

    def __init__(self, control: PlanExecutive, index: int, leaves: RunningLeaves) -> None:
        super().__init__(control, control.regression.steps[index], leaves)
        self.index = index

    def at_rest(self) -> Status:
        """Done or not needed, given up, or still to come."""
        if not self.control.rest.steps >> self.index & 1:
            return Status.SUCCESS
        return Status.FAILURE if self.step.name in self.control.exhausted else Status.INVALID

    def why(self) -> str:
        """Why the step is where it is, in one sentence."""
        return self.where().why

    def where(self) -> StepStatus:
        """Where the step is, and why, as data."""
        return step_status(self.control, self.index)


class KeptLeaf(RunLeaf):
    """A run of another plan that this plan goes on with, although it has no such step."""

    def why(self) -> str:
        """Why it runs, or that it does not."""
        run = self.run
        if run is None:
            return "has ended"
        return f"being halted: {run.halted_because}" if run.is_halting else "runs for what it gives"


class TaskTree(Composite):
    """Runs a plan until its goal holds, and for a maintain goal, keeps it so."""

    def __init__(
        self,
        task: GroundTask,
        plan: Plan,
        *,
        lasting: frozenset[str],
        leaves: RunningLeaves,
        kind: GoalKind,
        sight: Sight,
        exclusive: frozenset[str] = frozenset(),
        runs: Iterable[Run] = (),
        patience: Patience | None = None,
        setbacks: Setbacks | None = None,
        name: str = "task",
    ) -> None:
        """Make the tree of a plan that is valid in `task`.

        `lasting` names the schemas of lasting behaviours, `exclusive` the units that serve one
        behaviour at a time and move the body. `leaves` start and halt behaviours. `runs` is what
        another tree released: what the plan needs of it goes on, the rest is halted.
        """
        steps = steps_of(task, plan, lasting)
        self.control = PlanExecutive(
            Regression(steps, words(task, task.goal)),
            kind=kind,
            exclusive=exclusive,
            runs=runs,
            patience=patience,
            setbacks=setbacks,
        )
        self._sight = sight
        self._shown = 0
        self._left = self._active = 0
        self.steps = tuple(StepLeaf(self.control, index, leaves) for index in range(len(steps)))
        """The leaves of the plan's steps, in their order."""
        names = {step.name for step in steps}
        others = (run.step for run in self.control.runs.values() if run.step.name not in names)
        self._kept = {step.name: KeptLeaf(self.control, step, leaves) for step in others}
        super().__init__(name, [*self.steps, *self._kept.values()])

    @property
    def needs_replan(self) -> str | None:
        """Why the plan cannot go on, or None while it can."""
        return self.control.needs_replan

    def why(self) -> str:
        """Why the task is where it is, in one sentence."""
        control = self.control
        if control.phase is Phase.STUCK:
            return f"stuck: {control.needs_replan}"
        left = control.rest.steps.bit_count()
        return {
            Phase.UNDER_WAY: f"{left} of {len(self.steps)} steps are left",
            Phase.HOLDING: "the goal holds and is kept so",
            Phase.REACHED: "the goal is reached",
        }[control.phase]

    def release(self) -> tuple[Run, ...]:
        """Hand over what runs, for the tree that takes this one's place."""
        return self.control.release()

    def halt(self, because: str) -> None:
        """Halt everything that runs, at once and without another plan."""
        self.control.halt(because)
        self._stop_halting()

    def tick(self) -> Iterator[Behaviour]:
        """Decide, then have the leaves act: those that run are ticked, and those that moved."""
        if self.status is not Status.RUNNING:
            self.initialise()
        phase = self.control.decide(*self._sight())
        self._stop_halting()
        yield from self._act()
        status = _STATUS[phase]
        if status is Status.RUNNING:
            self.status = status
        else:
            self.stop(status)
        yield self

    def _stop_halting(self) -> None:
        """Stop the leaves of all runs that are to end, which halts these."""
        control = self.control
        names = [name for name, run in control.runs.items() if run.is_halting]
        for leaf in (self.steps[index] for index in bits(control.places_of(names))):
            leaf.stop(Status.INVALID)
        for name in names:
            if name in self._kept:
                self._kept[name].stop(Status.INVALID)

    def _act(self) -> Iterator[Behaviour]:
        self.current_child = None
        for leaf in self._to_tick():
            if leaf.is_to_run:
                if leaf.has_another_run:
                    leaf.stop(Status.FAILURE)  # its last run has ended: the tick starts this one
                self.current_child = leaf
                yield from leaf.tick()
            elif (status := leaf.at_rest()) is not leaf.status:
                leaf.stop(status)
                yield leaf

    def _to_tick(self) -> Iterator[RunLeaf]:
        """The leaves of runs, and after a decision those of steps that may have moved."""
        control = self.control
        active = control.places_of(control.runs)
        wanted = active
        if control.decisions != self._shown:
            self._shown = control.decisions
            shown, left = active | control.places_of(control.exhausted), control.rest.steps
            wanted |= shown | self._active | (left ^ self._left)
            self._left, self._active = left, shown
        yield from (self.steps[index] for index in bits(wanted))
        yield from self._kept.values()

    def terminate(self, new_status: Status) -> None:
        """Halt everything when something of higher priority interrupts the task."""
        if new_status is Status.INVALID:
            self.halt("the task was interrupted")

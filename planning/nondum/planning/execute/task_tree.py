"""The task tree: a plan as a py_trees composite, one leaf for each step.

The composite decides (see `plan_executive`); leaves show where each step is and answer why. It is
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
from nondum.planning.execute.running import Run, Runner, World
from nondum.planning.execute.step import steps_of, words
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


class StepLeaf(Behaviour):
    """Shows one step of the plan. The composite acts; this only reports."""

    def __init__(self, control: PlanExecutive, index: int) -> None:
        step = control.regression.steps[index]
        super().__init__(name=step.name)
        self.step = step
        self.index = index
        self.control = control

    def update(self) -> Status:
        """Where the step is: done or standing, under way, given up, or still to come."""
        run = self.control.runs.get(self.step.name)
        if run is not None and not run.is_halting:
            return Status.RUNNING
        if not self.control.rest.steps >> self.index & 1:
            return Status.SUCCESS
        return Status.FAILURE if self.step.name in self.control.exhausted else Status.INVALID

    def why(self) -> str:
        """Why the step is where it is, in one sentence."""
        return self.where().why

    def where(self) -> StepStatus:
        """Where the step is, and why, as data."""
        return step_status(self.control, self.index)


class TaskTree(Composite):
    """Runs a plan until its goal holds, and for a maintain goal, keeps it so."""

    def __init__(
        self,
        task: GroundTask,
        plan: Plan,
        *,
        lasting: frozenset[str],
        runner: Runner,
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
        behaviour at a time and move the body. `runs` is what another tree released: what the plan
        needs of it goes on, the rest is halted.
        """
        steps = steps_of(task, plan, lasting)
        self.control = PlanExecutive(
            Regression(steps, words(task, task.goal)),
            runner=runner,
            kind=kind,
            exclusive=exclusive,
            runs=runs,
            patience=patience,
            setbacks=setbacks,
        )
        self._sight = sight
        self._shown = 0
        self._left = self._active = 0
        self._leaves = [StepLeaf(self.control, index) for index in range(len(steps))]
        super().__init__(name, self._leaves)

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
            Phase.UNDER_WAY: f"{left} of {len(self._leaves)} steps are left",
            Phase.HOLDING: "the goal holds and is kept so",
            Phase.REACHED: "the goal is reached",
        }[control.phase]

    def release(self) -> tuple[Run, ...]:
        """Hand over what runs, for the tree that takes this one's place."""
        return self.control.release()

    def halt(self, because: str) -> None:
        """Halt everything that runs, at once and without another plan."""
        self.control.halt(because)

    def tick(self) -> Iterator[Behaviour]:
        """Decide, then show: where something moved, leaves are ticked so that visitors see them."""
        if self.status is not Status.RUNNING:
            self.initialise()
        phase = self.control.decide(*self._sight())
        if self.control.decisions != self._shown:
            self._shown = self.control.decisions
            yield from self._show()
        status = _STATUS[phase]
        if status is Status.RUNNING:
            self.status = status
        else:
            self.stop(status)
        yield self

    def _show(self) -> Iterator[Behaviour]:
        self.current_child = None
        for index in bits(self._may_have_moved()):
            leaf = self._leaves[index]
            status = leaf.update()
            if status is Status.RUNNING:
                self.current_child = leaf
                yield from leaf.tick()
            elif status is not leaf.status:
                leaf.stop(status)
                yield leaf

    def _may_have_moved(self) -> int:
        """The mask of the steps that were or are left, run or have been given up, but not both."""
        control = self.control
        left = control.rest.steps
        active = control.places_of((*control.runs, *control.exhausted))
        moved = active | self._active | (left ^ self._left)
        self._left, self._active = left, active
        return moved

    def terminate(self, new_status: Status) -> None:
        """Halt everything when something of higher priority interrupts the task."""
        if new_status is Status.INVALID:
            self.control.halt("the task was interrupted")

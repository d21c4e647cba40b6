"""What carries plans out: nondum's task tree, and the trees that others make of plans."""

from __future__ import annotations

from collections.abc import Sequence as Many
from enum import Enum
from typing import Protocol

from benchmarks.execution.leaves import Act, Check
from benchmarks.execution.robot import SimulatedRobot
from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Selector, Sequence

from nondum.planning.execute.attempts import Patience
from nondum.planning.execute.plan_executive import Phase
from nondum.planning.execute.running import RunningLeaves
from nondum.planning.execute.step import Step, steps_of
from nondum.planning.execute.task_tree import TaskTree
from nondum.sdk.planner import Plan


class Verdict(Enum):
    """What an executor says after a tick."""

    UNDER_WAY = "under way"
    REACHED = "reached"
    """It claims that the goal holds, and would do no more."""
    NEEDS_PLAN = "needs a plan"


_VERDICTS = {
    Status.RUNNING: Verdict.UNDER_WAY,
    Status.SUCCESS: Verdict.REACHED,
    Status.FAILURE: Verdict.NEEDS_PLAN,
}


class Executor(Protocol):
    """Made of a robot and a plan, in the place of the executor before."""

    @property
    def given_up(self) -> tuple[str, ...]:
        """Actions that should not be in the next plan."""
        ...

    def tick(self) -> Verdict:
        """Look at the world and act, once."""
        ...


class NondumTree:
    """The task tree of `nondum.planning`, as a host ticks it."""

    def __init__(self, robot: SimulatedRobot, plan: Plan, before: Executor | None) -> None:
        self.tree: TaskTree = TaskTree(
            robot.scene.task,
            plan,
            lasting=robot.scene.lasting,
            leaves=RunningLeaves(robot, lambda: robot.now_s),
            kind="achieve",
            sight=lambda: (robot, robot.now_s),
            exclusive=robot.scene.exclusive,
            runs=before.tree.release() if isinstance(before, NondumTree) else (),
            patience=Patience(settle_s=0.0),
        )

    @property
    def given_up(self) -> tuple[str, ...]:
        """Actions that failed too often in a row."""
        return self.tree.control.exhausted

    def tick(self) -> Verdict:
        """Tick the tree."""
        self.tree.tick_once()
        match self.tree.control.phase:
            case Phase.REACHED:
                return Verdict.REACHED
            case Phase.STUCK:
                return Verdict.NEEDS_PLAN
            case _:
                return Verdict.UNDER_WAY


class OpenLoop:
    """A sequence with memory: one action after the other, and success after the last."""

    given_up: tuple[str, ...] = ()

    def __init__(self, robot: SimulatedRobot, plan: Plan, before: Executor | None) -> None:
        robot.halt_all()
        leaves = [Act(robot, step) for step in planned(robot, plan)]
        self._tree = Sequence("plan", memory=True, children=leaves)

    def tick(self) -> Verdict:
        """Tick the tree; once it has failed it would begin again, so it is left."""
        if self._tree.status is not Status.FAILURE:
            self._tree.tick_once()
        return _VERDICTS[self._tree.status]


class Guarded:
    """A reactive sequence: each action stands behind a guard that skips it where its effects hold,
    and after its preconditions."""

    given_up: tuple[str, ...] = ()

    def __init__(self, robot: SimulatedRobot, plan: Plan, before: Executor | None) -> None:
        robot.halt_all()
        guarded = [_guarded(robot, step) for step in planned(robot, plan)]
        self._tree = Sequence("plan", memory=False, children=guarded)

    def tick(self) -> Verdict:
        """Tick the tree."""
        return verdict(self._tree)


def _guarded(robot: SimulatedRobot, step: Step) -> Selector:
    able = [Check(robot, step.precondition), Act(robot, step)]
    act = Sequence(f"do {step.name}", memory=False, children=able)
    return Selector(step.name, memory=False, children=[Check(robot, step.add), act])


def verdict(tree: Behaviour) -> Verdict:
    """What comes of a tick of a reactive tree. Its success is believed if it lasts: an action that
    did nothing begins again when it is ticked once more, and then its condition is seen to fail."""
    tree.tick_once()
    if tree.status is Status.SUCCESS:
        tree.tick_once()
    return _VERDICTS[tree.status]


def planned(robot: SimulatedRobot, plan: Plan) -> Many[Step]:
    """The steps of a plan in words."""
    return steps_of(robot.scene.task, plan, robot.scene.lasting)

"""The leaves of the trees that are compared with: conditions and actions, as py_trees has them."""

from __future__ import annotations

from benchmarks.execution.robot import SimulatedAction, SimulatedRobot
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from nondum.planning.execute.running import RunState
from nondum.planning.execute.step import Step


class Check(Behaviour):
    """Whether facts hold."""

    def __init__(self, robot: SimulatedRobot, facts: frozenset[str]) -> None:
        super().__init__(" ".join(sorted(facts)))
        self.facts = facts
        self._robot = robot

    def update(self) -> Status:
        """SUCCESS if they do."""
        return Status.SUCCESS if self.facts <= self._robot.facts else Status.FAILURE


class Act(Behaviour):
    """An action. A lasting one has succeeded when it is established, and is left to run: a tree
    that halted it then would undo what it is for."""

    def __init__(self, robot: SimulatedRobot, step: Step) -> None:
        super().__init__(step.name)
        self.step = step
        self._robot = robot
        self._running: SimulatedAction | None = None

    def initialise(self) -> None:
        """Start it, unless it runs."""
        if self._running is None or self._running.state is not RunState.ESTABLISHED:
            self._running = self._robot.start(self.step)

    def update(self) -> Status:
        """How far it is."""
        assert self._running is not None  # it was started
        match self._running.state:
            case RunState.STARTING:
                return Status.RUNNING
            case RunState.SUCCEEDED | RunState.ESTABLISHED:
                return Status.SUCCESS
            case _:
                return Status.FAILURE

    def terminate(self, new_status: Status) -> None:
        """Halt it where another part of the tree comes first."""
        is_starting = self._running is not None and self._running.state is RunState.STARTING
        if new_status is Status.INVALID and is_starting and self._running is not None:
            self._running.halt()

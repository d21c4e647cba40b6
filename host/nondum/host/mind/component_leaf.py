"""A leaf for integrators' system trees: it runs one behaviour of a component while it is ticked."""

from __future__ import annotations

from collections.abc import Callable

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from nondum.planning.execute.running import RunningAction, RunningLeaves, RunState
from nondum.planning.execute.step import Step
from nondum.sdk.errors import GoalRefused

_STATUS = {
    RunState.STARTING: Status.RUNNING,
    RunState.ESTABLISHED: Status.RUNNING,
    RunState.SUCCEEDED: Status.SUCCESS,
    RunState.FAILED: Status.FAILURE,
    RunState.HALTED: Status.FAILURE,
    RunState.GONE: Status.FAILURE,
}


class ComponentLeaf(Behaviour):
    """Starts a behaviour when it is first ticked, and halts it when it is interrupted.

    RUNNING while the behaviour runs; SUCCESS once it has finished; FAILURE if it failed, if its
    component is not here, or if its preconditions do not hold. A lasting behaviour is RUNNING until
    the leaf is interrupted.
    """

    def __init__(
        self, component: str, behaviour: str, step: Callable[[], Step], leaves: RunningLeaves
    ) -> None:
        """`step` gives what is to be done now, and raises `GoalRefused` where it cannot be done."""
        super().__init__(f"{component}.{behaviour}")
        self.component = component
        self.behaviour = behaviour
        self.step: Step | None = None
        """What it runs, or ran last."""
        self.action: RunningAction | None = None
        self._make_step = step
        self._leaves = leaves

    def initialise(self) -> None:
        """Start the behaviour."""
        self.step = self.action = None
        try:
            self.step = self._make_step()
        except GoalRefused as refused:
            self.feedback_message = str(refused)
        else:
            self.action = self._leaves.start(self.step)

    def update(self) -> Status:
        """How far the behaviour is."""
        if self.step is None or self.action is None:
            return Status.FAILURE
        self._leaves.tick(self.step, self.action)
        self.feedback_message = self.action.reason or self.action.progress
        return _STATUS[self.action.state]

    def terminate(self, new_status: Status) -> None:
        """Halt the behaviour where the leaf is interrupted."""
        if new_status is Status.INVALID and self.action is not None:
            self.action.halt()

    def why(self) -> str:
        """What it runs and how far that is, or why it cannot."""
        if self.step is None or self.status is Status.INVALID:
            return self.feedback_message or "is not ticked"
        return ": ".join(filter(None, (self.step.name, self.feedback_message)))

"""Behaviours for those who think in py_trees: `setup`, `initialise`, `update`, `terminate`."""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING, Any, ClassVar

if TYPE_CHECKING:
    from nondum.sdk.context import Context


class Status(Enum):
    """What a tick came to (the words of py_trees)."""

    RUNNING = "running"
    """Not done; tick again."""
    SUCCESS = "success"
    """Done, and the effects hold."""
    FAILURE = "failure"
    """Done, and they do not; `feedback_message` says why."""
    INVALID = "invalid"
    """Halted from outside; only ever seen by `terminate`."""


class TickedBehaviour:
    """A behaviour that is ticked on the worker's loop. Subclass it and mark it with `@behaviour`.

    One object is made per worker. `initialise` takes `ctx` and the action's parameters.
    """

    rate_hz: ClassVar[float] = 10.0
    """Ticks per second."""

    feedback_message: str = ""
    """Why, in words: shown with the result."""
    is_established: bool = False
    """A lasting behaviour sets it when its effects begin to hold; cleared before `initialise`."""

    def setup(self, ctx: Context) -> None:
        """Get ready, once, before the first start."""

    def initialise(self, ctx: Context, *arguments: Any) -> None:
        """Begin one run."""

    def update(self) -> Status:
        """Do one tick; return at once."""
        raise NotImplementedError

    def terminate(self, status: Status) -> None:
        """End one run, however it ended; leave everything safe."""

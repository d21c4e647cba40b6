"""Workers start, end, and make mistakes."""

from __future__ import annotations

from dataclasses import field
from typing import Any, ClassVar

from nondum.host.core.events.event import Event
from nondum.sdk.description import PluginDescription
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen


@frozen
class WorkerReady(Event):
    """A worker runs its plugin and has described it."""

    component: str
    description: PluginDescription
    payload: str = ""
    """Key of the payload whose worker it is: two releases may run side by side."""


@frozen
class WorkerExited(Event):
    """A worker ended or was ended, and will be started again unless a failure follows."""

    component: str
    reason: str
    payload: str = ""
    problem: Problem | None = field(default=None, repr=False)
    """The same as data."""

    def to_dict(self) -> dict[str, Any]:
        """The reason once."""
        return {"component": self.component, "reason": self.reason, "payload": self.payload}


@frozen
class WorkerStable(Event):
    """A worker that was started again has lived for a while: what was wrong is past."""

    component: str
    payload: str = ""


@frozen
class WorkerFailed(Event):
    """A worker will not be started again: it is quarantined."""

    component: str
    problems: tuple[Problem, ...]
    payload: str = ""


@frozen
class WorkerStrained(Event):
    """A worker uses nearly all that it may, or spins; it goes on. Told again only after a calm."""

    component: str
    problems: tuple[Problem, ...]


@frozen
class WorkerFaulted(Event):
    """A worker's plugin made a mistake that is not its end: it goes on. Each is told once."""

    component: str
    problems: tuple[Problem, ...]


@frozen
class ConditionEnded(Event):
    """A condition ended with an error: nothing tells its facts any more."""

    component: str
    condition: str
    problems: tuple[Problem, ...]
    payload: str = ""


@frozen
class WorkerLogged(Event):
    """A plugin logged a line."""

    JOURNALLED: ClassVar[bool] = False
    component: str
    level: str
    message: str

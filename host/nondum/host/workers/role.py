"""The role of a worker: active, tried beside the active one, or leaving.

Two releases of a payload may run side by side; which one stands for a component is what the
catalogue says. Only the events of that one are passed on; only that one is asked and wired.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum

from nondum.host.core.events.event import Event
from nondum.host.core.events.releases import TrialFailed
from nondum.host.core.events.workers import WorkerLogged


class Role(Enum):
    """The role of a worker."""

    BESIDE = "beside"
    """Another one stands for its component; this one is tried."""
    ACTIVE = "active"
    """It stands for its component."""
    LEAVING = "leaving"
    """Another one has taken its place; it is being stopped."""


EMITTED: Mapping[Role, tuple[type[Event], ...]] = {
    Role.BESIDE: (TrialFailed, WorkerLogged),
    Role.ACTIVE: (Event,),
    Role.LEAVING: (WorkerLogged,),
}
"""The events of a worker that are passed on. What it claims meanwhile is kept with it."""

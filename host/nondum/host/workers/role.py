"""How a worker counts: for its component, beside the one that does, or on its way out.

Two releases of a payload may run side by side; which one stands for a component is what the
catalogue says. Only that one is heard, asked and wired.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum

from nondum.host.core.events import Event, TrialFailed, WorkerLogged


class Role(Enum):
    """How a worker counts."""

    BESIDE = "beside"
    """Another one stands for its component; this one is tried."""
    IN_FORCE = "in force"
    """It stands for its component."""
    LEAVING = "leaving"
    """Another one has taken its place; it is being stopped."""


HEARD: Mapping[Role, tuple[type[Event], ...]] = {
    Role.BESIDE: (TrialFailed, WorkerLogged),
    Role.IN_FORCE: (Event,),
    Role.LEAVING: (WorkerLogged,),
}
"""What others hear of it. What it claims meanwhile is kept with the worker."""

"""Units are mounted somewhere else."""

from __future__ import annotations

from nondum.host.core.events.event import Event
from nondum.sdk.frozen import frozen


@frozen
class MountSet(Event):
    """A person said where a unit sits on its body (metres; roll, pitch, yaw in radians)."""

    unit: str
    xyz: tuple[float, float, float]
    rpy: tuple[float, float, float]

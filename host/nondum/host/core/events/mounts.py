"""Units are mounted somewhere else."""

from __future__ import annotations

from dataclasses import dataclass

from nondum.host.core.events.event import Event


@dataclass(frozen=True, slots=True)
class MountSet(Event):
    """A person said where a unit sits on its body (metres; roll, pitch, yaw in radians)."""

    unit: str
    xyz: tuple[float, float, float]
    rpy: tuple[float, float, float]

"""Head and laser as one thing that points: lit only while the head is where it should be."""

from __future__ import annotations

import math
from types import TracebackType

from nondum.sdk.errors import BehaviourFailed, Problem
from nondum_pan_tilt_unit.aim import Vector, apart, pan_tilt
from nondum_pan_tilt_unit.head import Aim, Head, is_at
from nondum_pan_tilt_unit.relay import Laser
from nondum_pan_tilt_unit.settings import Settings

_DARK_ABOVE_RAD = math.radians(2)
"""Larger corrections are made with the laser off."""


class Pointer:
    """A context manager: however it is left, the laser is off and the head stands still."""

    def __init__(self, head: Head, laser: Laser, settings: Settings) -> None:
        self._head = head
        self._laser = laser
        self._settings = settings
        self._aim: Aim | None = None

    async def ready(self) -> None:
        """Laser off, head set up, limits known."""
        settings = self._settings
        self._laser.off()
        await self._head.ready(speed_rad_s=math.radians(settings.speed_deg_s), reset=settings.reset)
        self._pan = self._head.pan.limited(
            math.radians(settings.pan_min_deg), math.radians(settings.pan_max_deg)
        )
        self._tilt = self._head.tilt.limited(
            math.radians(settings.tilt_min_deg), math.radians(settings.tilt_max_deg)
        )

    async def point(self, direction: Vector) -> None:
        """Turn to a direction in the unit's frame and light it. Returns when it is lit.

        Raises `BehaviourFailed` (PTU_OUT_OF_REACH, PTU_STALLED and the head's others).
        """
        pan, tilt = pan_tilt(direction)
        aim = Aim(self._pan.steps(pan), self._tilt.steps(tilt))
        if aim == self._aim:
            return
        if self._aim is None or self._apart(self._aim, aim) > _DARK_ABOVE_RAD:
            self._laser.off()
        self._aim = None
        await self._head.turn(aim)
        self._laser.on()
        self._aim = aim

    async def check(self) -> None:
        """Raise `BehaviourFailed` PTU_MOVED when the head is no longer where it was aimed."""
        position = await self._head.position()
        if self._aim is not None and not is_at(position, self._aim):
            message = f"aimed at {self._aim.pan}, {self._aim.tilt}, found at {position.pan}, "
            raise BehaviourFailed(
                Problem("PTU_MOVED", f"{message}{position.tilt} steps", where="pan-tilt unit")
            )

    def _apart(self, one: Aim, other: Aim) -> float:
        return apart(self._angles(one), self._angles(other))

    def _angles(self, aim: Aim) -> tuple[float, float]:
        return self._pan.angle(aim.pan), self._tilt.angle(aim.tilt)

    def __enter__(self) -> Pointer:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        try:
            self._laser.off()
        finally:
            self._head.halt()

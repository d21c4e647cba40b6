"""One stepper axis of a pan-tilt unit: trapezoidal moves between limits, in positions (steps)."""

from __future__ import annotations

import math
from dataclasses import dataclass

_SLICE_S = 0.002


@dataclass(slots=True)
class Axis:
    """Speeds in positions/s. Defaults are the PTU-D46's, pan axis."""

    name: str
    minimum: int
    maximum: int
    position: float = 0.0
    target: int = 0
    speed: int = 1000
    base_speed: int = 1000
    acceleration: int = 2000
    upper_speed: int = 2902
    lower_speed: int = 31
    resolution_arcsec: float = 185.1428
    velocity: float = 0.0
    _seized_at: float | None = None
    """Where the gear is stuck; steps are counted on."""

    @property
    def is_moving(self) -> bool:
        return self.position != self.target

    @property
    def angle_rad(self) -> float:
        """Where the head really points."""
        position = self.position if self._seized_at is None else self._seized_at
        return math.radians(position * self.resolution_arcsec / 3600)

    def seize(self) -> None:
        self._seized_at = self.position

    def halt(self) -> None:
        self.target = round(self.position + math.copysign(self._braking(), self.velocity))
        self.target = min(max(self.target, self.minimum), self.maximum)

    def advance(self, dt_s: float) -> None:
        """Let time pass."""
        slices = max(1, math.ceil(dt_s / _SLICE_S))
        for _ in range(slices):
            self._advance(dt_s / slices)

    def _advance(self, dt_s: float) -> None:
        left = self.target - self.position
        ceiling = max(self.base_speed, math.sqrt(2 * self.acceleration * abs(left)))
        wanted = math.copysign(min(self.speed, ceiling), left)
        slow = max(abs(wanted), abs(self.velocity)) <= self.base_speed
        change = self.acceleration * dt_s
        self.velocity = (
            wanted if slow else min(max(wanted, self.velocity - change), self.velocity + change)
        )
        moved = self.velocity * dt_s
        if abs(left) <= abs(moved) and moved * left >= 0:
            self.position, self.velocity = float(self.target), 0.0
        else:
            self.position += moved

    def _braking(self) -> float:
        over = max(0.0, self.velocity**2 - self.base_speed**2)
        return over / (2 * self.acceleration)

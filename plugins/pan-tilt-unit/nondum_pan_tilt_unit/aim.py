"""From a direction to the steps of two motors, within what they and the integrator allow.

The unit's frame (REP-103): x ahead at pan 0 and tilt 0, y left, z up. As the manual has it,
positive pan turns left and positive tilt up. Angles in radians. Pure.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from nondum.sdk.errors import BehaviourFailed, Problem

Vector = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Axis:
    """One motor's steps, as the unit itself reports them."""

    name: str
    """`pan` or `tilt`."""
    resolution_rad: float
    """Of one step (the unit calls it a position)."""
    minimum: int
    maximum: int

    @classmethod
    def reported(cls, name: str, arcsec: float, minimum: float, maximum: float) -> Axis:
        """From the answers to the resolution and limit queries."""
        return cls(name, math.radians(arcsec / 3600), round(minimum), round(maximum))

    def limited(self, low_rad: float, high_rad: float) -> Axis:
        """The same axis, kept within narrower limits."""
        return replace(
            self,
            minimum=max(self.minimum, math.ceil(low_rad / self.resolution_rad)),
            maximum=min(self.maximum, math.floor(high_rad / self.resolution_rad)),
        )

    def steps(self, angle_rad: float) -> int:
        """The step nearest to an angle. Raises `BehaviourFailed` PTU_OUT_OF_REACH."""
        wanted = round(angle_rad / self.resolution_rad)
        if self.minimum <= wanted <= self.maximum:
            return wanted
        low, high = (_degrees(self.angle(end)) for end in (self.minimum, self.maximum))
        raise BehaviourFailed(
            Problem(
                "PTU_OUT_OF_REACH",
                f"{self.name} cannot turn there",
                need=_degrees(angle_rad),
                have=f"{low} to {high}",
                fix="turn the body, or mount the unit another way (and enter that mount)",
            )
        )

    def angle(self, steps: float) -> float:
        return steps * self.resolution_rad


def pan_tilt(direction: Vector) -> tuple[float, float]:
    """The pan and tilt angles at which the unit's x axis lies along a direction.

    >>> pan, tilt = pan_tilt((0.0, 1.0, 1.0))
    >>> round(math.degrees(pan)), round(math.degrees(tilt))
    (90, 45)
    """
    x, y, z = direction
    return math.atan2(y, x), math.atan2(z, math.hypot(x, y))


def apart(one: tuple[float, float], other: tuple[float, float]) -> float:
    """The angle between two pan-tilt aims.

    >>> round(math.degrees(apart((0.0, 0.0), (math.radians(30), 0.0))), 6)
    30.0
    """
    (pan, tilt), (other_pan, other_tilt) = one, other
    across = math.sin((pan - other_pan) / 2) ** 2 * math.cos(tilt) * math.cos(other_tilt)
    return 2 * math.asin(math.sqrt(math.sin((tilt - other_tilt) / 2) ** 2 + across))


def _degrees(angle_rad: float) -> str:
    return f"{math.degrees(angle_rad):.1f}°"

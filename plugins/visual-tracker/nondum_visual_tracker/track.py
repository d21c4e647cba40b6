"""One person's bearing over time: a Kalman filter with constant velocity.

Somebody who is out of sight for longer than between two images is taken to come to rest: people
rather turn or stop than walk on along a circle.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from nondum_visual_tracker.sighting import Sighting

SIGHT_SIGMA = math.radians(1.5)
"""How far off a detector's box is, sideways, in radians."""
ACCELERATION_SIGMA = 0.3
"""How hard people change their bearing's rate, in rad/s²."""
FREE_S = 0.3
"""Time for which somebody unseen is taken to walk on as they did."""
DAMPING_S = 1.5
"""Time in which their rate falls to a third from then on."""
HEIGHT_SIGMA = 0.2
"""How far off a box's height is, as a share of it."""
_FIRST_RATE_SIGMA = 0.2
_HEIGHT_GAIN = 0.3


@dataclass(frozen=True, slots=True)
class Track:
    """The belief about one person at `stamp_s`."""

    number: int
    stamp_s: float
    azimuth: float
    rate: float
    variance: tuple[float, float, float]
    """Of azimuth; of both together; of rate."""
    height: float
    seen_s: float
    """When this person was last seen."""
    hits: int = 1
    range_m: float | None = None

    @classmethod
    def of(cls, number: int, sighting: Sighting, stamp_s: float) -> Track:
        """A person seen for the first time."""
        return cls(
            number=number,
            stamp_s=stamp_s,
            azimuth=sighting.azimuth,
            rate=0.0,
            variance=(SIGHT_SIGMA**2, 0.0, _FIRST_RATE_SIGMA**2),
            height=sighting.height,
            seen_s=stamp_s,
            range_m=sighting.range_m,
        )

    def at(self, stamp_s: float) -> Track:
        """The belief carried forward to a later time; an earlier one changes nothing."""
        dt = stamp_s - self.stamp_s
        if dt <= 0:
            return self
        a, b, c = self.variance
        free = min(max(self.seen_s + FREE_S - self.stamp_s, 0.0), dt)
        kept = math.exp(-(dt - free) / DAMPING_S)
        reach = free + DAMPING_S * (1 - kept)
        noise = ACCELERATION_SIGMA**2
        return replace(
            self,
            stamp_s=stamp_s,
            azimuth=self.azimuth + self.rate * reach,
            rate=self.rate * kept,
            variance=(
                a + 2 * reach * b + reach * reach * c + noise * dt**4 / 4,
                kept * (b + reach * c) + noise * dt**3 / 2,
                kept * kept * c + noise * dt * dt,
            ),
        )

    def distance(self, sighting: Sighting) -> float:
        """Squared, in standard deviations: how little this sighting looks like this person."""
        sideways = (sighting.azimuth - self.azimuth) ** 2 / (self.variance[0] + SIGHT_SIGMA**2)
        size = math.log(sighting.height / self.height) / HEIGHT_SIGMA
        return sideways + size * size

    def seen(self, sighting: Sighting) -> Track:
        """The belief after this person was seen again, at this track's own stamp."""
        a, b, c = self.variance
        innovation = sighting.azimuth - self.azimuth
        gain, rate_gain = a / (a + SIGHT_SIGMA**2), b / (a + SIGHT_SIGMA**2)
        return replace(
            self,
            azimuth=self.azimuth + gain * innovation,
            rate=self.rate + rate_gain * innovation,
            variance=((1 - gain) * a, (1 - gain) * b, c - rate_gain * b),
            height=self.height + _HEIGHT_GAIN * (sighting.height - self.height),
            seen_s=self.stamp_s,
            hits=self.hits + 1,
            range_m=self.range_m if sighting.range_m is None else sighting.range_m,
        )

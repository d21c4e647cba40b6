"""Whether a body stands still or moves, by its odometry. Pure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from demo.following import Stamped, unwrapped

STILL_RAD = math.radians(0.2)
STILL_M = 0.01

Placed = tuple[float, float, float]
"""Seconds, and metres along two axes."""


@dataclass(frozen=True, slots=True)
class Motion:
    """How far a body moved in a stretch of time."""

    turned_rad: float
    """Between the utmost headings."""
    moved_m: float
    """Between the utmost places, along the axis where that is more."""

    @property
    def is_still(self) -> bool:
        """Whether both are as small as noise."""
        return self.turned_rad < STILL_RAD and self.moved_m < STILL_M

    def __str__(self) -> str:
        return f"{math.degrees(self.turned_rad):.2f}° and {100 * self.moved_m:.1f} cm"


def motion(
    headings: Sequence[Stamped], places: Sequence[Placed], begin_s: float, end_s: float
) -> Motion | None:
    """How the body moved between two times; None where odometry does not reach over them."""
    stamps = [stamp for stamp, _ in headings]
    if not stamps or stamps[0] > begin_s or stamps[-1] < end_s:
        return None
    turned = [yaw for stamp, yaw in unwrapped(headings) if begin_s <= stamp <= end_s]
    along = [(x, y) for stamp, x, y in places if begin_s <= stamp <= end_s]
    if not turned or not along:
        return None
    return Motion(_span(turned), max(map(_span, zip(*along, strict=True))))


def _span(values: Sequence[float]) -> float:
    return max(values) - min(values)

"""What several runs come to: the middle, the spread, and ratios of those taken side by side."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Spread:
    """The middle of some values, and how far they lie apart."""

    median: float
    low: float
    high: float
    count: int


def spread(values: Sequence[float]) -> Spread:
    """Median, least and greatest of at least one value.

    >>> spread([3.0, 1.0, 2.0])
    Spread(median=2.0, low=1.0, high=3.0, count=3)
    """
    return Spread(statistics.median(values), min(values), max(values), len(values))


def ratios(values: Sequence[float], against: Sequence[float]) -> Spread:
    """Of values to others, pair by pair: each pair was measured in one round, under one load.

    >>> ratios([1.0, 4.0], [2.0, 4.0])
    Spread(median=0.75, low=0.5, high=1.0, count=2)
    """
    return spread([one / other for one, other in zip(values, against, strict=True)])

"""When something happened."""

from __future__ import annotations

from nondum.sdk.frozen import frozen


@frozen
class Moment:
    """When something happened, by both clocks."""

    monotonic_s: float
    """Seconds since boot, for durations."""
    wall_s: float
    """Seconds since the epoch, for people."""


UNKNOWN_MOMENT = Moment(0.0, 0.0)
"""When that is not known."""

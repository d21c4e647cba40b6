"""How often something comes, and when it is overdue: pure."""

from __future__ import annotations

from nondum.sdk.frozen import frozen

STALL_S = 1.0
"""Nothing is overdue sooner."""
PERIODS = 3
"""What comes slowly is overdue when this number of its periods have passed."""
FIRST_S, LONGEST_FIRST_S = 5.0, 30.0
"""How long a second one is waited for at least and at most: nothing is known of the period yet but
how long the first one took."""
_KEPT = 0.8
"""What counts of the longest period when one comes sooner."""


@frozen
class Pace:
    """The pace of what has come so far.

    >>> slow = Pace(last_s=10.0).after(12.0)
    >>> slow.overdue_s
    18.0
    >>> Pace(last_s=10.0).after(10.1).overdue_s
    11.1
    >>> Pace(last_s=10.0, first_took_s=4.0).overdue_s
    22.0
    """

    last_s: float
    """When the last one came."""
    period_s: float | None = None
    """The longest of late between two; None: only one has come."""
    first_took_s: float = 0.0
    """How long the first one was waited for."""

    def after(self, now_s: float) -> Pace:
        """The pace once one more has come."""
        return Pace(now_s, max(now_s - self.last_s, _KEPT * (self.period_s or 0.0)))

    @property
    def overdue_s(self) -> float:
        """When the next one is overdue."""
        if self.period_s is None:
            wait_s = min(PERIODS * self.first_took_s, LONGEST_FIRST_S)
            return self.last_s + max(FIRST_S, wait_s)
        return self.last_s + max(STALL_S, PERIODS * self.period_s)

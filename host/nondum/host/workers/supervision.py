"""When a worker that crashed is started again, and when no more. Pure; times are given."""

from __future__ import annotations

from dataclasses import replace

from nondum.sdk.frozen import frozen

RESTARTS = 3
"""Within `WINDOW_S`; the next crash is one too many."""
WINDOW_S = 60.0


@frozen
class Supervision:
    """The crashes of one component's worker that still count. An expected end is none."""

    crashes: tuple[float, ...] = ()
    """When they were, in seconds, oldest first."""
    backoff_s: float = 1.0
    """Before the first restart; doubled for each further one."""

    def crashed(self, now_s: float) -> Supervision:
        """With one more crash, and without those that are long ago.

        >>> Supervision((0.0, 50.0)).crashed(70.0).crashes
        (50.0, 70.0)
        """
        recent = tuple(at_s for at_s in self.crashes if now_s - at_s < WINDOW_S)
        return replace(self, crashes=(*recent, now_s))

    @property
    def is_exhausted(self) -> bool:
        """Whether it crashed too often to be started again."""
        return len(self.crashes) > RESTARTS

    @property
    def delay_s(self) -> float:
        """How long to wait before the next start.

        >>> [Supervision((0.0,) * crashes).delay_s for crashes in range(4)]
        [0.0, 1.0, 2.0, 4.0]
        """
        return self.backoff_s * 2.0 ** (len(self.crashes) - 1) if self.crashes else 0.0

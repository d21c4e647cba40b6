"""Who vouches for a payload that is here, as people are shown it."""

from __future__ import annotations

import time
from datetime import datetime

from nondum.sdk.frozen import frozen


@frozen
class Vouched:
    """What is known of it, as far as it was asked."""

    signers: tuple[str, ...] = ()
    """Names, or fingerprints of keys that have none."""
    built: str = ""
    """When they say that it was built: UTC, ISO 8601."""

    @property
    def age_s(self) -> float | None:
        """Seconds since then; None: nothing is known of it."""
        return age_s(self.built)


UNVOUCHED = Vouched()
CLOCKS_DIFFER_S = 60.0
"""So far clocks may be apart."""


def age_s(built: str) -> float | None:
    """Seconds since a payload was built, as it says (UTC, ISO 8601) and as this clock goes; None if
    that is yet to come: one of them is wrong.

    >>> age_s(""), age_s("2999-01-01T00:00:00Z")
    (None, None)
    """
    if not built:
        return None
    age = time.time() - datetime.fromisoformat(built).timestamp()
    return max(0.0, age) if age >= -CLOCKS_DIFFER_S else None

"""How often a host pings its peers. Pure."""

from __future__ import annotations

import math

BEAT_S = 0.3
"""Time between two pings: sent by the loop that does the work, so that its hanging is noticed."""
QUICK_LINKS = 32
"""Peers that are pinged so often. With more of them, each is pinged less often, and told so."""
STEPS_PER_LINK = 5 / 67
"""100 hosts ping each other every 1.8 s: with pings of every host to every other, a fleet's work
grows with its square."""


def beat_s(links: int) -> float:
    """Time between two pings of one peer: a multiple of `BEAT_S`.

    >>> beat_s(2), beat_s(32), beat_s(50), beat_s(99), beat_s(256)
    (0.3, 0.3, 0.9, 1.8, 5.4)
    """
    steps = 1 + max(0, links - QUICK_LINKS) * STEPS_PER_LINK
    return round(BEAT_S * math.ceil(round(steps, 6)), 6)

"""How far the clock of a stream's owner is ahead of the reader's. Pure; times are given.

Every answered ping bounds it: the owner's clock was read between the ping's leaving and the
answer's coming. Source: RFC 5905, section 8, in its simplest form.
"""

from __future__ import annotations

from nondum.sdk.frozen import frozen

DRIFT = 1e-4
"""How much a clock may gain on another one, as a part of the time: twice what crystals do."""


@frozen
class _Bounds:
    least_s: float
    most_s: float
    at_s: float

    def width_s(self, now_s: float) -> float:
        return self.most_s - self.least_s + 2 * DRIFT * (now_s - self.at_s)


class Clocks:
    """What is known of one owner's clock."""

    def __init__(self) -> None:
        self._bounds: _Bounds | None = None

    def pong_received(self, sent_s: float, owner_s: float, now_s: float) -> None:
        """A ping was answered: `owner_s` is by the owner's clock, the others by the reader's."""
        newer = _Bounds(owner_s - now_s, owner_s - sent_s, now_s)
        older = self._bounds
        if older is None or newer.width_s(now_s) <= older.width_s(now_s):
            self._bounds = newer

    @property
    def are_known(self) -> bool:
        """Whether any ping was answered."""
        return self._bounds is not None

    @property
    def ahead_s(self) -> float:
        """How far the owner's clock is ahead: 0 as long as nothing says that they differ.

        Hosts on one machine share a clock, and their stamps stay what they are to the last bit.
        """
        bounds = self._bounds
        if bounds is None or bounds.least_s <= 0 <= bounds.most_s:
            return 0.0
        return (bounds.least_s + bounds.most_s) / 2

"""How much of a file may be on its way at once, so that other messages of the link are not kept
waiting behind it. Pure.

The idea is RFC 6817's (LEDBAT): what takes longer than the quickest piece did has waited in queues;
when that is too long, less is asked for. A full link stays usable, an idle one is filled.
"""

from __future__ import annotations

LARGEST = 64 * 1024
"""Bytes of one piece: half of what a message may have."""
LEAST = 16 * 1024
MOST = 1024 * 1024
PIECES = 4
"""The least number of pieces in a window."""
WAIT_S = 0.1
"""What others may be kept waiting."""


class Pace:
    """The window of one transfer, and what was learnt of its link.

    >>> pace = Pace()
    >>> pace.piece
    4096
    """

    def __init__(self) -> None:
        self.window = LEAST
        """Bytes that may be on their way."""
        self._quickest_s = float("inf")

    @property
    def piece(self) -> int:
        """Bytes to ask for next, at most."""
        return min(LARGEST, self.window // PIECES)

    def answered(self, length: int, took_s: float) -> None:
        """A piece has come, so long after it was asked for."""
        self._quickest_s = min(self._quickest_s, took_s)
        if took_s - self._quickest_s > WAIT_S:
            self.window = max(LEAST, self.window // 2)
        else:
            self.window = min(MOST, self.window + length)

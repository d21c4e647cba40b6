"""How much may be under way to one reader: what keeps a slow link from filling with old frames.

Pure; times are given. What was sent and not handled yet lies in buffers of two kernels and the
network, where nothing can replace it any more. So little may lie there: two frames at most, since
one alone would leave the link idle for a round trip, and only one as long as a frame takes much
longer than the round trip. Small messages may be more.
"""

from __future__ import annotations

from collections import deque

from nondum.sdk.frozen import frozen

FRAMES = 2
"""Messages that may be under way, whatever their size."""
SMALL_BYTES = 16 * 1024
"""More messages may be, as long as all together are no more than this …"""
SMALL_MESSAGES = 64
"""… and no more of them than this."""
SLOW_ROUND_TRIPS = 4.0
"""A frame that takes more round trips than this fills the link by itself."""
SLOW_S = 0.05
"""A frame that is handled sooner than this does not."""


@frozen
class _Sent:
    seq: int
    length: int
    at_s: float


class Window:
    """What is under way, and what was learnt of the link from what is not any more."""

    def __init__(self) -> None:
        self._sent: deque[_Sent] = deque()
        self._bytes = 0
        self._is_slow = False

    @property
    def can_send(self) -> bool:
        """Whether one more message may be sent now."""
        count = len(self._sent)
        if self._bytes <= SMALL_BYTES and count < SMALL_MESSAGES:
            return True
        return count < (1 if self._is_slow else FRAMES)

    def sent(self, seq: int, length: int, now_s: float) -> None:
        """A message has been sent."""
        self._sent.append(_Sent(seq, length, now_s))
        self._bytes += length

    def handled(self, seq: int, now_s: float, round_trip_s: float) -> bool:
        """The reader has handled a message, which it does in order; False if it was not its turn.

        `round_trip_s` is what the network takes there and back with nothing in its way.
        """
        if not self._sent or self._sent[0].seq != seq:
            return False
        sent = self._sent.popleft()
        self._bytes -= sent.length
        self._is_slow = now_s - sent.at_s > max(SLOW_S, SLOW_ROUND_TRIPS * round_trip_s)
        return True

"""A token bucket: how much may pass now, given a steady rate and a burst. Pure; times are given."""

from __future__ import annotations


class TokenBucket:
    """Fills at `rate` tokens a second up to `burst`, and begins full."""

    def __init__(self, rate: float, burst: float, now_s: float) -> None:
        self._rate, self._burst = rate, burst
        self._tokens, self._at_s = burst, now_s

    def take(self, wanted: float, now_s: float) -> bool:
        """Take `wanted` tokens if there are as many; take none otherwise.

        >>> bucket = TokenBucket(rate=10, burst=5, now_s=0.0)
        >>> bucket.take(5, 0.0), bucket.take(1, 0.05), bucket.take(1, 0.1)
        (True, False, True)
        """
        self._tokens = min(self._burst, self._tokens + self._rate * (now_s - self._at_s))
        self._at_s = now_s
        if wanted > self._tokens:
            return False
        self._tokens -= wanted
        return True

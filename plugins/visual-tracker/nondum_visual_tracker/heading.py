"""Which way the body faced when an image was taken."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import deque

_KEPT_S = 5.0
_FRESH_S = 0.5
_EXTRAPOLATE_S = 0.3


class Heading:
    """Headings over the last seconds, in radians to the left, never wrapped.

    Odometry says them where it is offered. Where it is not, or stalls, the body is taken to have
    turned as it was told: rough over minutes, good enough over the third of a second that an
    image is old when its detections come.
    """

    def __init__(self) -> None:
        self._samples: deque[tuple[float, float, float]] = deque([(-math.inf, 0.0, 0.0)])
        self._measured_s = -math.inf
        self._offset = 0.0

    def measured(self, stamp_s: float, yaw: float) -> None:
        """Odometry says `yaw` at `stamp_s`; samples older than the newest are ignored."""
        if stamp_s <= self._samples[-1][0] and self._is_measured(stamp_s):
            return
        here = self.at(stamp_s)
        if not self._is_measured(stamp_s):
            self._offset = here - yaw
        turned = math.remainder(yaw + self._offset - here, math.tau)
        self._measured_s = stamp_s
        self._append(stamp_s, here + turned)

    def commanded(self, stamp_s: float, rate: float) -> None:
        """The body was told to turn at `rate` rad/s from `stamp_s` on."""
        if self._is_measured(stamp_s):
            return
        self._append(stamp_s, self.at(stamp_s), rate)

    def at(self, stamp_s: float) -> float:
        """The heading at a time; a little beyond the newest sample it goes on turning."""
        after = bisect_right(self._samples, (stamp_s, math.inf, math.inf))
        if after == 0:
            return self._samples[0][1]
        stamp, heading, rate = self._samples[after - 1]
        if after == len(self._samples):
            if not math.isfinite(stamp):
                return heading
            return heading + rate * min(stamp_s - stamp, _EXTRAPOLATE_S)
        next_stamp, next_heading, _ = self._samples[after]
        if not math.isfinite(stamp):
            return next_heading
        share = (stamp_s - stamp) / (next_stamp - stamp)
        return heading + share * (next_heading - heading)

    def _is_measured(self, stamp_s: float) -> bool:
        return stamp_s - self._measured_s < _FRESH_S

    def _append(self, stamp_s: float, heading: float, rate: float | None = None) -> None:
        stamp, last, _ = self._samples[-1]
        if stamp_s <= stamp:
            return
        if rate is None:
            rate = (heading - last) / (stamp_s - stamp) if math.isfinite(stamp) else 0.0
        self._samples.append((stamp_s, heading, rate))
        while self._samples[1][0] < stamp_s - _KEPT_S:
            self._samples.popleft()

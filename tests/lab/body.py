"""A body's motion by its odometry: whether it stands, turns, or keeps a person straight ahead.

Times are the machine's own, since its processor is emulated; the recording is played in slow
motion, by so much slower as emulated detectors are. What judges is the demonstration's own.
"""

from __future__ import annotations

import math
from functools import partial

from demo.body_motion import Motion, motion
from demo.following import WANTED_FRACTION, WINDOW_S, Reference, score_following
from tests.lab.demonstration import FollowedStream, frames, headings, places
from tests.lab.installed import Installed

PATIENCE_S = 1500.0
LOOK_S = 3.0
STILL_S = 2.0
TURNING_S = 2.0
TURNING_RAD = math.radians(1.0)


class Body:
    """The body of one host, followed from now on."""

    def __init__(self, host: Installed, reference: Reference, speed: float) -> None:
        """`speed` is how fast the recording is played."""
        self._machine, self._reference = host.machine, reference
        self._odometry = FollowedStream(host, "pose")
        self._window_s = WINDOW_S / speed

    def until_still(self) -> float:
        """Wait until it has stood for a while; answers its heading."""
        self._machine.until("the body stands", partial(self._is_still, STILL_S), PATIENCE_S)
        return headings(self._odometry.rows())[-1][1]

    def until_turning(self) -> None:
        """Wait until it turns: standing still proves nothing of one that stood before."""
        self._machine.until("the body turns", self._is_turning, PATIENCE_S, LOOK_S)

    def until_following(self, images: FollowedStream, start_rad: float) -> float:
        """Wait until the person was ahead in enough of the images of one window, which is as much
        of the recording as the demonstration judges; answers in how many. `start_rad` is where the
        body looked when the stream of images began."""
        best = [0.0]

        def found() -> float | None:
            share = self.share(images, start_rad)
            best[0] = max(best[0], share)
            return share if share >= WANTED_FRACTION else None

        try:
            return self._machine.until("the person ahead", found, PATIENCE_S, LOOK_S)
        except AssertionError as error:
            raise AssertionError(f"{error}: in {best[0]:.0%} of images at best") from None

    def share(self, images: FollowedStream, start_rad: float) -> float:
        """The share of images of the last window with the person ahead."""
        heard, shown = headings(self._odometry.rows()), frames(images.rows())
        if not heard or not shown:
            return 0.0
        return score_following(
            heard, shown, self._reference, window_s=self._window_s, start_rad=start_rad
        )

    def moved(self, begin_s: float, seconds: float) -> Motion:
        """How it moves in a stretch of time, once that is over."""
        wanted = partial(self._motion, begin_s, begin_s + seconds)
        return self._machine.until("odometry", wanted, PATIENCE_S, LOOK_S)

    def now_s(self) -> float:
        """The newest stamp that was heard."""
        stamps = [row["stamp_s"] for row in self._odometry.rows()]
        return stamps[-1] if stamps else 0.0

    def _motion(self, begin_s: float, end_s: float) -> Motion | None:
        rows = self._odometry.rows()
        return motion(headings(rows), places(rows), begin_s, end_s)

    def _lately(self, seconds: float) -> Motion | None:
        end_s = self.now_s()
        return self._motion(end_s - seconds, end_s)

    def _is_still(self, seconds: float) -> bool | None:
        moved = self._lately(seconds)
        return True if moved is not None and moved.is_still else None

    def _is_turning(self) -> bool | None:
        moved = self._lately(TURNING_S)
        return True if moved is not None and moved.turned_rad > TURNING_RAD else None

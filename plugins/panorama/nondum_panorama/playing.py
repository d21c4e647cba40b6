"""Which frame a recording shows when: a still at first, then to and fro for ever."""

from __future__ import annotations

from dataclasses import dataclass

from nondum_panorama.clip import Clip


@dataclass(frozen=True, slots=True)
class Score:
    """The order of frames of one clip, by the time since the stream began.

    >>> score = Score(first=4, last=6, frames_per_s=1.0, hold_s=2.0, rest_s=1.0)
    >>> [score.frame_at(second) for second in range(10)]
    [4, 4, 4, 5, 6, 6, 5, 4, 4, 5]
    """

    first: int
    last: int
    frames_per_s: float
    hold_s: float = 0.0
    """How long the first frame stands still before anything moves."""
    rest_s: float = 0.0
    """How long the picture stands still at both ends, in place of one frame's time."""

    @classmethod
    def of(cls, clip: Clip, *, hold_s: float, speed: float = 1.0) -> Score:
        """As the clip is stated to be played, or that much faster; `hold_s` is as long as given."""
        rate, rest_s = clip.frames_per_s * speed, clip.rest_s / speed
        return cls(clip.first, clip.last, rate, hold_s=hold_s, rest_s=rest_s)

    def frame_at(self, elapsed_s: float) -> int:
        """The number of the frame that is shown `elapsed_s` after the stream began."""
        # A hundred-thousandth of a frame: 0.3 s at 10 frames/s is the third frame, not the second.
        step = int((elapsed_s - self.hold_s) * self.frames_per_s + 1e-5)
        span = self.last - self.first
        if step <= 0 or span == 0:
            return self.first
        rest = round(self.rest_s * self.frames_per_s)
        leg = span + rest
        way, along = divmod(step, leg)
        forth = min(along, span)
        return self.first + forth if way % 2 == 0 else self.last - forth

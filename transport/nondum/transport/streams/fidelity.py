"""Whether a stream's images travel as they are or as JPEG. Pure; times are given.

What a link can take is not known before it is tried: rates that are measured while little is sent
say little, and other traffic comes and goes. So images are compressed as soon as too many had to
be dropped because the link was full, and tried as they are after a calm time, which is longer after
each trial that failed.
"""

from __future__ import annotations

from nondum.transport.streams.packets import Coding

PERIOD_S = 1.0
"""Over which images that were sent and dropped are counted …"""
TRIAL_S = 0.5
"""… and over which a trial is judged."""
DROPPED = 0.2
"""The part of all images whose loss says that the link is too slow for them."""
ENOUGH = 4
"""Images that a judgement needs."""
PATIENCE_S = 5.0
"""How long it must be calm before images are tried as they are."""
MOST_PATIENCE_S = 120.0


class Fidelity:
    """The coding of one stream to one reader."""

    def __init__(self, now_s: float) -> None:
        self.coding = Coding.RAW
        """How the next image is to travel."""
        self._patience_s = PATIENCE_S
        self._trial_ends_s = now_s
        self._restless_s = now_s
        self._begin_period(now_s)

    def sent(self, now_s: float) -> None:
        """An image was sent."""
        self._sent += 1
        self._judge(now_s)

    def dropped(self, now_s: float) -> None:
        """An image gave way to a newer one because the link was full."""
        self._dropped += 1
        self._judge(now_s)

    def _begin_period(self, now_s: float) -> None:
        self._since_s, self._sent, self._dropped = now_s, 0, 0

    def _judge(self, now_s: float) -> None:
        is_trial = self.coding is Coding.RAW and now_s < self._trial_ends_s
        images = self._sent + self._dropped
        if now_s - self._since_s < (TRIAL_S if is_trial else PERIOD_S) or images < ENOUGH:
            return
        is_crowded = self._dropped > DROPPED * images
        self._begin_period(now_s)
        if is_crowded:
            self._restless_s = now_s
        if self.coding is Coding.RAW and is_crowded:
            self._patience_s = (
                min(2 * self._patience_s, MOST_PATIENCE_S) if is_trial else PATIENCE_S
            )
            self.coding = Coding.JPEG
        elif self.coding is Coding.JPEG and now_s - self._restless_s >= self._patience_s:
            self._trial_ends_s = now_s + self._patience_s
            self.coding = Coding.RAW

"""What somebody else says while the robot speaks, cut out of what is heard.

Voice activity detection would take what is left of the own voice for a voice. So somebody else
speaks where much of what was heard is left when the own voice is taken out, and that is loud enough
to be no leavings.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from nondum_speech.own_voice import FRAME, OwnVoice
from nondum_speech.sound import Samples, Sound

OTHERS_SHARE = 0.3
"""So much of the amplitude must be left when the own voice is taken out."""
OTHERS_LEVEL = 0.25
"""And what is left must be so loud, next to the own voice as it is heard on the mean."""
LEAST_LEVEL = 50.0
"""Root mean square: the same where the own voice is not heard."""
SHORTEST, LONGEST = 13, 250
"""Frames of a hundredth of a second: what is left of the own voice comes in shorter bursts, and
words that stop are shorter."""
PAUSE = 25
"""So many frames without anybody end it."""
_SMOOTHED = 5
_BEFORE, _AFTER = 15, 20
"""A word begins and ends more softly than is told from what is left of the own voice."""


class Interruptions:
    """Listens while the robot says one sentence."""

    def __init__(self, own: OwnVoice) -> None:
        self._own = own
        self._rest: Samples = np.zeros(0, np.int16)
        self._powers: list[float] = []
        """Of what is left, a frame each."""
        self._heard_powers: list[float] = []
        self._taken_out = 0.0
        """The sum of what was taken out."""
        self._first: int | None = None
        self._last = 0

    def heard(self, piece: Sound) -> Iterator[Sound]:
        """Take more of what is heard, and give what somebody else has said until then."""
        apart = self._own.heard(piece)
        begin = len(self._powers)
        self._rest = np.concatenate([self._rest, apart.rest])
        self._powers += _powers(apart.rest)
        self._heard_powers += _powers(apart.heard)
        for frame in range(begin, len(self._powers)):
            if self._is_others(frame):
                self._first = frame if self._first is None else self._first
                self._last = frame
            elif self._first is not None and frame - self._last > PAUSE:
                first, self._first = self._first, None
                if SHORTEST <= self._last - first <= LONGEST:
                    start, end = max(0, first - _BEFORE), self._last + _AFTER
                    yield Sound(self._rest[start * FRAME : end * FRAME])

    def _is_others(self, frame: int) -> bool:
        window = slice(max(0, frame + 1 - _SMOOTHED), frame + 1)
        rest, heard = (_mean(powers[window]) for powers in (self._powers, self._heard_powers))
        self._taken_out += self._heard_powers[frame] - self._powers[frame]
        least = max(LEAST_LEVEL**2, OTHERS_LEVEL**2 * self._taken_out / (frame + 1))
        return rest >= OTHERS_SHARE**2 * heard and rest >= least


def _mean(powers: list[float]) -> float:
    return sum(powers) / len(powers)


def _powers(samples: Samples) -> list[float]:
    frames = samples.astype(np.float64).reshape(-1, FRAME)
    return [float(power) for power in np.mean(frames**2, axis=1)]

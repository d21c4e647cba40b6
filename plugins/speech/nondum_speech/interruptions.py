"""Finds what a person says while the robot speaks, in the sound of the microphone.

Voice activity detection would take the residual echo of the robot's own voice for a voice. So a
person speaks where much of the sound remains when the own voice is taken out, and where that rest
is louder than residual echo.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from nondum_speech.own_voice import FRAME, OwnVoice
from nondum_speech.sound import Samples, Sound

OTHERS_SHARE = 0.3
"""The share of the amplitude that must remain when the own voice is taken out."""
OTHERS_LEVEL = 0.25
"""The least level of the rest, as a share of the mean level of the own voice."""
LEAST_LEVEL = 50.0
"""Root mean square: the same where the own voice is not heard."""
SHORTEST, LONGEST = 13, 250
"""Frames of a hundredth of a second: what is left of the own voice comes in shorter bursts, and
words that stop are shorter."""
PAUSE = 25
"""The number of frames without a voice that end an interruption."""
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

    def feed(self, piece: Sound) -> Iterator[Sound]:
        """Take more samples; yield each interruption that has ended with them."""
        apart = self._own.feed(piece)
        begin = len(self._powers)
        self._rest = np.concatenate([self._rest, apart.rest])
        self._powers += _powers(apart.rest)
        self._heard_powers += _powers(apart.heard)
        for frame in range(begin, len(self._powers)):
            if self._is_other_voice(frame):
                self._first = frame if self._first is None else self._first
                self._last = frame
            elif self._first is not None and frame - self._last > PAUSE:
                first, self._first = self._first, None
                if SHORTEST <= self._last - first <= LONGEST:
                    start, end = max(0, first - _BEFORE), self._last + _AFTER
                    yield Sound(self._rest[start * FRAME : end * FRAME])

    def _is_other_voice(self, frame: int) -> bool:
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

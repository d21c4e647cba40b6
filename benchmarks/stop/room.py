"""A robot in a room, simulated: how its own voice, and a person's, come to its microphone.

The loudspeaker is small: it has no bass, is uneven, and is driven a little too far. The way from it
to the microphone is the same as long as the robot is; what the walls reflect differs each time,
for robots move. The delay until a player starts varies.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from nondum_speech.sound import RATE_HZ

REVERBERATION_S = 0.4
"""Until it has fallen by 60 dB."""
OF_OWN, OF_PERSON = 0.35, 0.3
"""Amplitude of the sound that the walls reflect, next to that of the direct sound."""
_START_S = (0.1, 0.5)
_LOWEST_HZ = 250.0
_UNEVEN = 0.15
"""Decades of amplitude, by which a loudspeaker's response walks."""
_LAG = 8
_DRY = 40
"""Samples before anything comes back."""

Waves = npt.NDArray[Any]


class Room:
    """One robot's loudspeaker and microphone, and an impulse response that differs each time."""

    def __init__(self, seed: int) -> None:
        self._chance = np.random.default_rng(seed)
        self._response = self._loudspeaker(int(REVERBERATION_S * RATE_HZ))

    def start_s(self) -> float:
        """How long a player and a recorder take."""
        return float(self._chance.uniform(*_START_S))

    def own(self, samples: Waves) -> Waves:
        """The robot's own voice at its microphone, as loud as it was."""
        peak = float(np.abs(samples).max(initial=0)) + 1
        driven = np.tanh(samples / peak) * peak
        way = np.fft.irfft(np.fft.rfft(self._impulse_response(OF_OWN)) * self._response)
        heard = np.convolve(driven, np.roll(way, _LAG))
        return heard * (float(np.std(samples)) / max(1.0, float(np.std(heard[: len(samples)]))))

    def person(self, samples: Waves) -> Waves:
        """A person's voice, as loud as it was."""
        heard = np.convolve(samples, self._impulse_response(OF_PERSON))
        return heard * (float(np.std(samples)) / max(1.0, float(np.std(heard[: len(samples)]))))

    def _impulse_response(self, strength: float) -> Waves:
        length = int(REVERBERATION_S * RATE_HZ)
        fallen = 10 ** (-3 * np.arange(length) / length)
        way = self._chance.normal(0, 1, length) * fallen
        way[:_DRY] = 0
        way *= strength / float(np.sqrt((way**2).sum()))
        way[0] = 1
        return way

    def _loudspeaker(self, length: int) -> Waves:
        hertz = np.fft.rfftfreq(length, 1 / RATE_HZ)
        bass = 1 / (1 + (_LOWEST_HZ / np.maximum(hertz, 1)) ** 4)
        walk = np.cumsum(self._chance.normal(0, 1, len(hertz))) / np.sqrt(len(hertz))
        response: Waves = bass * 10 ** (_UNEVEN * walk)
        return response

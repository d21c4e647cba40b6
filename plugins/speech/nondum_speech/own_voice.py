"""Takes the robot's own voice out of the microphone's sound, while it says one sentence.

WebRTC's echo canceller does so. The delay until a player starts varies: cross-correlation finds
the sample where the sentence begins to be heard. Samples wait until it is found.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from pywebrtc_audio import EchoCanceller

from nondum_speech.sound import RATE_HZ, Samples, Sound

FRAME = RATE_HZ // 100
"""Samples that the canceller takes at once."""
LONGEST_WAY_S = 1.5
"""From a sentence's start until it is heard, with the player's start and the recorder's delay."""
_FIRST_LOOK_S, _LOOK_AGAIN_S, _LAST_LOOK_S = 0.6, 0.3, 2.4
_EARLY = RATE_HZ // 50
"""Samples: the canceller wants to know what is played before it is heard."""
_WHITENED = 0.7
"""All frequencies count nearly alike: a voice's low ones alone would say little of when."""
_NOTHING = 1e-9
_CLEAR = 10.0
"""Where the own voice was not, nothing came above 8 times the mean; where it was, it came above 20
when a person spoke 10 dB louder, and above 10 when 20 dB louder."""

Waves = npt.NDArray[Any]


@dataclass(frozen=True, slots=True, eq=False)
class Apart:
    """Some whole frames."""

    heard: Samples
    rest: Samples
    """Without the own voice."""


class OwnVoice:
    """Takes one sentence out of what is heard while it is said, and shortly after."""

    def __init__(self, said: Sound, canceller: EchoCanceller) -> None:
        """`canceller` keeps what it learns of the way from where it is played to the microphone."""
        self._said = said.samples
        self._canceller = canceller
        self._waiting: Samples = np.zeros(0, np.int16)
        self._played: Samples | None = None
        self._look_at = int(_FIRST_LOOK_S * RATE_HZ)
        self._is_audible = True

    def feed(self, piece: Sound) -> Apart:
        """Take more samples; give those whose own voice is known by now, with and without it."""
        self._waiting = np.concatenate([self._waiting, piece.samples])
        if self._played is None:
            self._look()
        length = len(self._waiting) // FRAME * FRAME if self._played is not None else 0
        ready, self._waiting = np.split(self._waiting, [length])
        return Apart(ready, self._rest_of(ready) if length and self._is_audible else ready)

    def _look(self) -> None:
        """Find out when the sentence began to be heard."""
        length = len(self._waiting)
        if length < self._look_at:
            return
        self._look_at += int(_LOOK_AGAIN_S * RATE_HZ)
        way = way_of(self._said[:length], self._waiting, int(LONGEST_WAY_S * RATE_HZ))
        if way is not None:
            self._played = np.concatenate([np.zeros(max(0, way - _EARLY), np.int16), self._said])
        elif length >= _LAST_LOOK_S * RATE_HZ:
            self._played, self._is_audible = np.zeros(0, np.int16), False

    def _rest_of(self, ready: Samples) -> Samples:
        assert self._played is not None, "only asked when it is known"
        played, self._played = self._played[: len(ready)], self._played[len(ready) :]
        return self._canceller.process(ready, np.pad(played, (0, len(ready) - len(played))))


def way_of(own: Waves, heard: Waves, longest: int) -> int | None:
    """How many samples after it was given to be played the own voice is heard; None: it is
    not, or not yet."""
    size = 1 << (len(own) + len(heard)).bit_length()
    cross = np.fft.rfft(heard, size) * np.fft.rfft(own, size).conj()
    cross /= np.abs(cross) ** _WHITENED + _NOTHING
    likeness = np.abs(np.fft.irfft(cross)[:longest])
    way = int(np.argmax(likeness))
    is_clear = likeness[way] > _CLEAR * np.sqrt(np.mean(likeness**2))
    return way if is_clear else None

"""A simulated microphone beside a loudspeaker: it hears the robot and persons who speak to it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from nondum_speech.sound import RATE_HZ, Sound

START_S = 0.25
"""A player takes so long to begin."""
PIECE = RATE_HZ // 50


def overheard(own: Sound, word: Sound | None = None, *, at_s: float = 2.0) -> Sound:
    """The own voice at half its strength and with a simulated reverberation, and a person's
    words."""
    chance = np.random.default_rng(5)
    way = np.zeros(1600)
    way[0] = 0.5
    way[40:] = chance.normal(0, 0.012, 1560) * np.linspace(1, 0, 1560)
    heard = np.pad(np.convolve(own.samples, way), (int(START_S * RATE_HZ), RATE_HZ))
    heard += chance.normal(0, 10, len(heard))
    if word is not None:
        begin = int(at_s * RATE_HZ)
        heard[begin : begin + len(word.samples)] += word.samples
    return Sound(np.clip(heard, -32768, 32767).astype(np.int16))


def pieces(sound: Sound) -> Iterator[Sound]:
    """As a recorder gives them."""
    for start in range(0, len(sound.samples), PIECE):
        yield Sound(sound.samples[start : start + PIECE])

"""Takes the own voice out of what a microphone heard: an adaptive filter.

A partitioned-block Kalman filter in the frequency domain: how the own voice comes from the
loudspeaker to the microphone is a long filter, cut into partitions of one block; each frequency of
each partition has an estimate and how uncertain that is. It goes on learning while a person speaks,
too, since an error that its uncertainty does not explain moves it little. F. Kuech et al.,
"State-space architecture of the partitioned-block-based acoustic echo controller", ICASSP 2014.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

BLOCK = 256
"""Samples that are handled at once: 16 ms."""
PARTITIONS = 12
"""Of one block each: what comes later than 0.19 s is not taken out."""
_KEPT = 0.999
"""So much of an estimate is believed a block later: robots move, and rooms with them."""
_DIRECT, _REVERBERANT, _DECAY = 1.0, 0.05, 0.8
"""How strong the first partition, and each after it, may be before anything is known."""
_ERROR_WEIGHS = 0.5
_LEAST_POWER = 1e3

Waves = npt.NDArray[Any]


class EchoCanceller:
    """The filter, and what it has learnt."""

    def __init__(self) -> None:
        strengths = [_DIRECT, *(_REVERBERANT * _DECAY**n for n in range(PARTITIONS - 1))]
        bins = BLOCK + 1
        self._filter = np.zeros((PARTITIONS, bins), np.complex128)
        self._uncertain = np.outer(strengths, np.ones(bins))
        self._spectra = np.zeros((PARTITIONS, bins), np.complex128)
        self._played = np.zeros(2 * BLOCK)

    def heard(self, played: Waves, block: Waves) -> tuple[Waves, Waves]:
        """What is left of a block when the own voice is taken out, and what was taken out.

        `played` is what the loudspeaker was given as long ago as its way takes.
        """
        self._played = np.concatenate([self._played[BLOCK:], played])
        self._spectra = np.roll(self._spectra, 1, axis=0)
        self._spectra[0] = np.fft.rfft(self._played)
        own = np.fft.irfft((self._filter * self._spectra).sum(axis=0))[BLOCK:]
        rest = block - own
        self._learn(np.fft.rfft(np.concatenate([np.zeros(BLOCK), rest])))
        return rest, own

    def _learn(self, error: Waves) -> None:
        power = np.abs(self._spectra) ** 2
        explained = 0.5 * (self._uncertain * power).sum(axis=0)
        step = self._uncertain / (explained + _ERROR_WEIGHS * np.abs(error) ** 2 + _LEAST_POWER)
        kept = _KEPT**2
        self._uncertain *= kept * (1 - 0.5 * step * power)
        self._uncertain += (1 - kept) * np.abs(self._filter) ** 2
        self._filter += step * self._spectra.conj() * error
        response = np.fft.irfft(self._filter, axis=1)
        response[:, BLOCK:] = 0
        self._filter = np.fft.rfft(response, axis=1)


def way_of(own: Waves, heard: Waves, longest: int) -> int | None:
    """How many samples after it was given to the loudspeaker the own voice is heard; None: it is
    not, or not yet."""
    size = 1 << (len(own) + len(heard)).bit_length()
    cross = np.fft.rfft(heard, size) * np.fft.rfft(own, size).conj()
    cross /= np.abs(cross) ** _WHITENED + _NOTHING
    likeness = np.abs(np.fft.irfft(cross)[:longest])
    way = int(np.argmax(likeness))
    is_clear = likeness[way] > _CLEAR * np.sqrt(np.mean(likeness**2))
    return way if is_clear else None


_WHITENED = 0.7
"""All frequencies count nearly alike: a voice's low ones alone would say little of when."""
_NOTHING = 1e-9
_CLEAR = 10.0
"""Where the own voice was not, nothing came above 8 times the mean; where it was, it came above 20
when a person spoke 10 dB louder, and above 10 when 20 dB louder."""

"""PocketSphinx's decoders, and what they make of a sound.

https://cmusphinx.github.io; the wheel carries its model of American English.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Any

import numpy as np
from pocketsphinx import Decoder, get_model_path

from nondum_speech.sound import RATE_HZ, Samples, Sound

_SILENCE_S = 0.3
_HISS = 15.0
"""Rms of noise that is added: the recogniser fails on exact digital silence."""
_SHIFT = 1024
"""The library's scores are likelihoods to this root (SENSCR_SHIFT)."""
_LEAST = 1e-300
_NOT_SPOKEN = ("<", "(", "[", "+")
_VARIANT = re.compile(r"\(\d+\)$")


@dataclass(frozen=True, slots=True)
class Segment:
    """A word, or a phone, in a sound."""

    word: str
    first: int
    """Its first frame, of a hundredth of a second."""
    last: int


@dataclass(frozen=True, slots=True)
class Decoding:
    """What a decoder takes a sound for."""

    segments: tuple[Segment, ...]
    """Without silence and noise."""
    acoustic: float
    """Log-likelihood of the sound, of silence too."""
    total: float
    """The same with the likelihood of such words, or phones, after each other."""

    @property
    def words(self) -> tuple[str, ...]:
        """What was said."""
        return tuple(segment.word for segment in self.segments)


def decoder(**options: Any) -> Decoder:
    """Make a decoder; scores of different ones compare.

    For that, all score every state of the model in every frame. What a lattice of a grammar's
    words gives may be the beginning of a sentence only, so none is made.
    """
    return Decoder(
        hmm=get_model_path("en-us/en-us"),
        loglevel="FATAL",
        cmn="batch",
        compallsen=True,
        bestpath=False,
        **options,
    )


def decoded(by: Decoder, samples: Samples) -> Decoding | None:
    """Decode a sound; None when nothing fits it."""
    by.reinit_feat()  # else what it knows of noise comes from the sound before
    by.start_utt()
    by.process_raw(samples.tobytes(), full_utt=True)
    by.end_utt()
    best, parts = by.hyp(), by.seg()
    if best is None or parts is None:
        return None
    segments: list[Segment] = []
    acoustic = 0.0
    for part in parts:
        acoustic += _logarithm(part.ascore)
        if not part.word.startswith(_NOT_SPOKEN):
            word = _VARIANT.sub("", part.word)
            segments.append(Segment(word, part.start_frame, part.end_frame))
    return Decoding(tuple(segments), acoustic, _logarithm(best.score))


def made_audible(sound: Sound) -> Samples:
    """With a little silence around, and none of it exact; the same each time."""
    silence = np.zeros(int(_SILENCE_S * RATE_HZ), np.int16)
    samples = np.concatenate([silence, sound.samples, silence]).astype(np.float64)
    samples += np.random.default_rng(0).normal(0.0, _HISS, len(samples))
    return np.clip(samples, -32768, 32767).astype(np.int16)


def frames_of(samples: Samples) -> float:
    """How many frames a sound has."""
    return len(samples) / RATE_HZ * 100


def _logarithm(score: float) -> float:
    return math.log(max(score, _LEAST)) * _SHIFT

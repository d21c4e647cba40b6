"""Sound to a sentence that can be said now, or to the reason why it is none.

PocketSphinx hears by the grammar, which gives the nearest sentence whatever was said. A second
decoder hears the same sound as any phones at all: where the words explain the sound much worse than
free phones do, something else was said.
"""

from __future__ import annotations

import math
import re
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pocketsphinx import Decoder, get_model_path

from nondum_speech.grammar import PHONE_WORDS, Vocabulary, jsgf
from nondum_speech.lexicon import Lexicon
from nondum_speech.sound import RATE_HZ, Samples, Sound

_MODEL = "en-us/en-us"
_SILENCE_S = 0.3
_HISS = 15.0
"""Rms of noise that is added: the recogniser fails on exact digital silence."""
_FRAME_S = 0.01
_NOT_SPOKEN = ("<", "(", "[", "++")
_VARIANT = re.compile(r"\(\d+\)$")
_LEAST = -708.0
"""Stands for the logarithm of a likelihood too small for a number."""
_UNWEIGHED = frozenset({"the", "a", "an"})
"""Too short to be sure of, and of no meaning."""


@dataclass(frozen=True, slots=True)
class Heard:
    """What a sound was taken for."""

    words: str
    """The nearest sentence; empty where there is none."""
    confidence: float
    """Of its worst word: log-likelihood a frame against free phones. Zero is as good as any."""
    said: str = ""
    """`words` if it was said; empty if something else was."""


@dataclass(frozen=True, slots=True)
class _Segment:
    word: str
    first: int
    last: int
    score: float
    """Log-likelihood of the sound."""

    @property
    def frames(self) -> int:
        return self.last - self.first + 1


class Recogniser:
    """Hears the sentences of one vocabulary; not for several threads at once."""

    def __init__(self, vocabulary: Vocabulary, lexicon: Lexicon, *, confidence: float) -> None:
        """`confidence`: what the worst word must reach to be taken as said."""
        self._confidence = confidence
        grammar = jsgf(vocabulary, frozenset(lexicon.pronunciations))
        self._words: Decoder | None = None
        self._free: Decoder | None = None
        self._dictation: Decoder | None = None
        if grammar is None:
            return
        with tempfile.TemporaryDirectory() as folder:
            dictionary, rules = Path(folder, "words.dict"), Path(folder, "said.gram")
            phones = "".join(f"{word} {phone}\n" for word, phone in PHONE_WORDS.items())
            dictionary.write_text(lexicon.to_dictionary() + phones, encoding="ascii")
            rules.write_text(grammar + "\n", encoding="ascii")
            self._words = _decoder(dict=str(dictionary), jsgf=str(rules), bestpath=False)
            self._free = _decoder(
                dict=str(dictionary), allphone=get_model_path("en-us/en-us-phone.lm.bin")
            )

    def hear(self, sound: Sound) -> Heard:
        """Recognise one sentence. Takes about a fifth of the time that it took to say it."""
        if self._words is None or self._free is None:
            return Heard("", _LEAST)
        samples = _made_audible(sound)
        segments = list(_decoded(self._words, samples))
        words = " ".join(segment.word for segment in segments)
        if not self._words.get_fsg().accept(words):  # the beginning of a sentence is none
            return Heard("", _LEAST)
        confidence = _worst(segments, list(_decoded(self._free, samples)))
        text = self._in_words(segments, samples)
        return Heard(text, confidence, said=text if confidence >= self._confidence else "")

    def _in_words(self, segments: list[_Segment], samples: Samples) -> str:
        """The sentence, with words of the whole dictionary where any may stand."""
        text: list[str] = []
        free: list[_Segment] = []
        for segment in (*segments, None):
            if segment is not None and segment.word in PHONE_WORDS:
                free.append(segment)
                continue
            if free:
                step = int(RATE_HZ * _FRAME_S)
                text.append(self._dictated(samples[free[0].first * step : free[-1].last * step]))
                free = []
            if segment is not None:
                text.append(segment.word)
        return " ".join(text)

    def _dictated(self, samples: Samples) -> str:
        if self._dictation is None:
            self._dictation = _decoder(
                dict=get_model_path("en-us/cmudict-en-us.dict"),
                lm=get_model_path("en-us/en-us.lm.bin"),
            )
        return " ".join(s.word for s in _decoded(self._dictation, samples)) or "something"


def _decoder(**options: Any) -> Decoder:
    """Scores of different decoders compare: all weigh a frame against the same best state."""
    return Decoder(
        hmm=get_model_path(_MODEL), loglevel="FATAL", cmn="batch", compallsen=True, **options
    )


def _made_audible(sound: Sound) -> Samples:
    """With a little silence around, and none of it exact; the same each time."""
    silence = np.zeros(int(_SILENCE_S * RATE_HZ), np.int16)
    samples = np.concatenate([silence, sound.samples, silence]).astype(np.float64)
    samples += np.random.default_rng(0).normal(0.0, _HISS, len(samples))
    return np.clip(samples, -32768, 32767).astype(np.int16)


def _decoded(decoder: Decoder, samples: Samples) -> Iterator[_Segment]:
    """The words, or phones, of a sound, without silence and noise."""
    decoder.start_utt()
    decoder.process_raw(samples.tobytes(), full_utt=True)
    decoder.end_utt()
    for part in decoder.seg() or ():
        if not part.word.startswith(_NOT_SPOKEN):
            score = math.log(part.ascore) if part.ascore > 0 else _LEAST
            yield _Segment(_VARIANT.sub("", part.word), part.start_frame, part.end_frame, score)


def _worst(words: list[_Segment], phones: list[_Segment]) -> float:
    """How much worse than by free phones the sound of the worst word is explained, a frame."""
    by_frame = {
        frame: phone.score / phone.frames
        for phone in phones
        for frame in range(phone.first, phone.last + 1)
    }
    return min(
        (
            (word.score - sum(by_frame.get(f, 0.0) for f in range(word.first, word.last + 1)))
            / word.frames
            for word in words
            if word.word not in PHONE_WORDS and word.word not in _UNWEIGHED
        ),
        default=_LEAST,
    )

"""Sound to a sentence that can be said now, or to the reason why it is none.

A grammar's decoder gives the nearest sentence, whatever was said. So the same sound is heard freely
too: as any words of the dictionary, and as any phones. Where the sentence explains the sound worse
than those do, something else was said.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path

from pocketsphinx import Decoder, get_model_path

from nondum_speech.decoding import (
    Decoding,
    Segment,
    decoded,
    decoder,
    frames_of,
    made_audible,
)
from nondum_speech.grammar import PHONE_WORDS, Vocabulary, jsgf, sentences
from nondum_speech.lexicon import Lexicon
from nondum_speech.sound import Samples, Sound

PHONES_WEIGH = 0.5
"""What phones count beside words; see the benchmark."""
CLEARLY = 0.25
"""Log-likelihood a frame, by which another sentence must be nearer than words that stop."""
_UNSAID = "something"
"""Stands for free words that are none of the dictionary's."""


@dataclass(frozen=True, slots=True)
class Recognition:
    """The sentence that a sound was taken for, and with which confidence."""

    words: str
    """The nearest sentence; empty where there is none."""
    confidence: float
    """How well it explains the sound: log-likelihood a frame, less that of anything free."""
    said: str = ""
    """`words` if that was said; empty if something else was."""


@dataclass(frozen=True, slots=True)
class Limits:
    """What a sentence must reach to be taken as said; nearer zero is stricter."""

    confidence: float
    stop_confidence: float
    """For words that stop the robot: a stop that is missed is worse than one too many."""


NOTHING = Recognition("", float("-inf"))


class FreeHearing:
    """Hears anything: it is what a sentence has to compare with. Takes 0.3 s to make."""

    def __init__(self) -> None:
        dictionary = get_model_path("en-us/cmudict-en-us.dict")
        language, phones = (get_model_path(f"en-us/en-us{kind}.lm.bin") for kind in ("", "-phone"))
        self._words = decoder(dict=dictionary, lm=language, fwdflat=False, maxhmmpf=5000)
        self._phones = decoder(dict=dictionary, allphone=phones)

    def words(self, samples: Samples) -> Decoding | None:
        """As words of the dictionary, likely after each other."""
        return decoded(self._words, samples)

    def phones(self, samples: Samples) -> Decoding | None:
        """As phones of English, likely after each other."""
        return decoded(self._phones, samples)


class Recogniser:
    """Hears the sentences of one vocabulary; not for several threads at once."""

    def __init__(
        self, vocabulary: Vocabulary, lexicon: Lexicon, free: FreeHearing, limits: Limits
    ) -> None:
        self._free, self._limits = free, limits
        spoken = (sentences(pattern, vocabulary.names) for pattern in vocabulary.stops)
        self._stops = frozenset(said for pattern in spoken for said in pattern)
        self._grammatical = _decoder_of(vocabulary, lexicon)
        self._stopping = _decoder_of(replace(vocabulary, phrases=vocabulary.stops), lexicon)

    def hear(self, sound: Sound) -> Recognition:
        """Recognise one sentence, in about a quarter of the time that it took to say it."""
        samples = made_audible(sound)
        sentence = _sentence(self._grammatical, samples)
        if sentence is None:
            return NOTHING
        words, phones = self._free.words(samples), self._free.phones(samples)
        if words is None or phones is None:
            return NOTHING
        worse = sentence.acoustic - words.acoustic
        worse += PHONES_WEIGH * (sentence.total - phones.total)
        confidence = worse / frames_of(samples)
        text = " ".join(_with_free_words(sentence, words))
        limits = self._limits
        limit = limits.stop_confidence if text in self._stops else limits.confidence
        return Recognition(text, confidence, said=text if confidence >= limit else "")

    def stop_in(self, sound: Sound) -> str:
        """Words that stop, unless another sentence that can be said is clearly nearer to what
        somebody said, or nothing fits; else "". What else may have been said is not asked: it is
        for sounds that are known to be a person's, and damaged."""
        samples = made_audible(sound)
        stop = _sentence(self._stopping, samples)
        if stop is None:
            return ""
        other = _sentence(self._grammatical, samples)
        worse = other.acoustic - stop.acoustic if other else 0.0
        return " ".join(stop.words) if worse <= CLEARLY * frames_of(samples) else ""


def _sentence(by: Decoder | None, samples: Samples) -> Decoding | None:
    """The nearest sentence of a grammar, if it is no mere beginning of one."""
    if by is None:
        return None
    sentence = decoded(by, samples)
    return sentence if sentence and by.get_fsg().accept(" ".join(sentence.words)) else None


def _decoder_of(vocabulary: Vocabulary, lexicon: Lexicon) -> Decoder | None:
    grammar = jsgf(vocabulary, frozenset(lexicon.pronunciations))
    if grammar is None:
        return None
    phones = "".join(f"{word} {phone}\n" for word, phone in PHONE_WORDS.items())
    with tempfile.TemporaryDirectory() as folder:
        dictionary, rules = Path(folder, "words.dict"), Path(folder, "said.gram")
        dictionary.write_text(lexicon.to_dictionary() + phones, encoding="utf-8")
        rules.write_text(grammar + "\n", encoding="utf-8")
        return decoder(dict=str(dictionary), jsgf=str(rules))


def _with_free_words(sentence: Decoding, free: Decoding) -> Iterator[str]:
    """The sentence, with the dictionary's words where any may stand."""
    for is_free, group in groupby(sentence.segments, lambda s: s.word in PHONE_WORDS):
        segments = tuple(group)
        if is_free:
            yield " ".join(_within(segments, free)) or _UNSAID
        else:
            yield from (segment.word for segment in segments)


def _within(segments: tuple[Segment, ...], free: Decoding) -> Iterator[str]:
    for segment in free.segments:
        if segments[0].first <= (segment.first + segment.last) / 2 <= segments[-1].last:
            yield segment.word

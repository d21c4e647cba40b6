"""Words that stop, heard while the robot speaks: a person need not wait until it has ended.

PocketSphinx spots key phrases in the flow of sound, without the end of a sentence, which there is
none of while the robot speaks. By itself it takes much that is said for such a phrase. So a phrase
counts only where somebody else spoke: where much of what was heard is left when the own voice is
taken out, and that is loud enough to be no leavings. And only if what is left is nearer to it than
to all other sentences that can be said, and what the robot said just then is not.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
from pocketsphinx import Decoder, get_model_path

from nondum_speech.echo import BLOCK, EchoCanceller
from nondum_speech.grammar import Vocabulary, sentences
from nondum_speech.lexicon import Lexicon
from nondum_speech.own_voice import OwnVoice
from nondum_speech.sound import RATE_HZ, Samples, Sound

STRICTNESS = -5.0
"""A power of ten for each phone of a phrase: how much less likely than any other phones it may be;
nearer zero is stricter."""
OTHERS_SHARE = 0.35
"""So much of a phrase's power must be left when the own voice is taken out."""
OTHERS_LEVEL = 0.3
"""And what is left must be so loud, next to the own voice as it is heard on the mean."""
_BEFORE_S, _AFTER_S = 0.2, 0.12
"""A phrase is heard again with what is around it."""
_SAME = 20
"""Frames: spots of a phrase that end nearer to each other are heard again once."""
_HISS = 15.0
_FRAME = RATE_HZ // 100
_VARIANT = re.compile(r"\(\d+\)")

Nearest = Callable[[Sound], str]
"""The sentence that can be said and is nearest to a sound."""


@dataclass(frozen=True, slots=True)
class Spot:
    """Where a phrase may have been said, in frames of a hundredth of a second."""

    phrase: str
    first: int
    last: int


class StopSpotter:
    """Listens for the phrases that stop in what is heard while the robot says something."""

    def __init__(
        self, vocabulary: Vocabulary, lexicon: Lexicon, canceller: EchoCanceller, nearest: Nearest
    ) -> None:
        """`canceller` keeps what it learns of the robot's voice; `nearest` knows `vocabulary`."""
        self._canceller, self._nearest = canceller, nearest
        self._phrase_of = {
            form: phrase
            for phrase, forms in stop_phrases(vocabulary, lexicon).items()
            for form in forms
        }
        self._decoder = _decoder_of(dict.fromkeys(self._phrase_of.values()), lexicon)
        self._chance = np.random.default_rng(0)
        self._own: OwnVoice | None = None
        self._rest: Samples = np.zeros(0, np.int16)
        self._judged: set[tuple[str, int]] = set()

    def begin(self, said: Sound) -> None:
        """From now on the robot says this."""
        self._end()
        self._own = OwnVoice(said, self._canceller)
        self._decoder.reinit_feat()
        self._decoder.start_utt()

    def heard(self, piece: Sound) -> str:
        """Take more of what is heard meanwhile; gives a phrase that stops, once, when it was
        said."""
        if self._own is None:
            return ""
        rest = self._own.heard(piece)
        if not len(rest):
            return ""
        rest = rest + self._chance.normal(0, _HISS, len(rest))
        samples = np.clip(rest, -32768, 32767).astype(np.int16)
        self._rest = np.concatenate([self._rest, samples])
        self._decoder.process_raw(samples.tobytes())
        said = next((spot.phrase for spot in self._spots() if self._is_said(spot)), "")
        if said:
            self._end()
        return said

    def _end(self) -> None:
        if self._own is not None:
            self._decoder.end_utt()
        self._own, self._rest, self._judged = None, np.zeros(0, np.int16), set()

    def _spots(self) -> Iterator[Spot]:
        for segment in self._decoder.seg() or ():
            phrase = _VARIANT.sub("", segment.word).strip()
            yield Spot(phrase, segment.start_frame, segment.end_frame)

    def _is_said(self, spot: Spot) -> bool:
        """Whether it was, by somebody else."""
        judged = (spot.phrase, spot.last // _SAME)
        if judged in self._judged or not self._is_others(spot):
            return False
        self._judged.add(judged)
        begin = max(0, spot.first * _FRAME - int(_BEFORE_S * RATE_HZ))
        end = spot.last * _FRAME + int(_AFTER_S * RATE_HZ)
        if self._phrase_in(Sound(self._rest[begin:end])) != spot.phrase:
            return False
        assert self._own is not None, "only asked while something is said"
        return self._phrase_in(self._own.said_in(begin, end)) != spot.phrase

    def _phrase_in(self, sound: Sound) -> str | None:
        return self._phrase_of.get(self._nearest(sound))

    def _is_others(self, spot: Spot) -> bool:
        """Whether somebody else spoke there."""
        assert self._own is not None, "only asked while something is said"
        if not self._own.is_audible:
            return True
        first, last = (frame * _FRAME // BLOCK for frame in (spot.first, spot.last))
        powers = self._own.powers[first : last + 1]
        rest, heard = sum(power.rest for power in powers), sum(power.heard for power in powers)
        least = OTHERS_LEVEL**2 * self._own.mean_power * len(powers)
        return self._own.is_taken_out and rest >= OTHERS_SHARE * heard and rest >= least


def stop_phrases(vocabulary: Vocabulary, lexicon: Lexicon) -> dict[str, tuple[str, ...]]:
    """The shortest form of each pattern that stops the robot and can be pronounced, with all its
    forms.

    >>> known = Lexicon({"hold": ("HH OW L D",), "still": ("S T IH L",)}, (), ())
    >>> stop_phrases(Vocabulary(stops=("stop", "[please] hold still")), known)
    {'hold still': ('please hold still', 'hold still')}
    """
    sayable = lexicon.pronunciations.keys()
    forms = (tuple(sentences(pattern, vocabulary.names)) for pattern in vocabulary.stops)
    shortest = {min(found, key=lambda form: len(form.split())): found for found in forms if found}
    return {phrase: forms for phrase, forms in shortest.items() if sayable >= {*phrase.split()}}


def _decoder_of(phrases: Iterable[str], lexicon: Lexicon) -> Decoder:
    lines = (line for phrase in phrases for line in _spotted(phrase, lexicon))
    with tempfile.TemporaryDirectory() as folder:
        dictionary, spotted = Path(folder, "words.dict"), Path(folder, "spotted.list")
        dictionary.write_text(lexicon.to_dictionary(), encoding="utf-8")
        spotted.write_text("".join(lines), encoding="utf-8")
        return Decoder(
            hmm=get_model_path("en-us/en-us"),
            loglevel="FATAL",
            dict=str(dictionary),
            kws=str(spotted),
        )


def _spotted(phrase: str, lexicon: Lexicon) -> Iterator[str]:
    """A line for each way to pronounce it: spotting knows no variants by itself."""
    for variants in product(*(tuple(_variants(word, lexicon)) for word in phrase.split())):
        spelling = " ".join(name for name, _ in variants)
        phones = sum(count for _, count in variants)
        yield f"{spelling} /1e{STRICTNESS * phones:.0f}/\n"


def _variants(word: str, lexicon: Lexicon) -> Iterator[tuple[str, int]]:
    """The names of a word's pronunciations, as the dictionary calls them, and their lengths."""
    for number, phones in enumerate(lexicon.pronunciations[word], 1):
        yield (f"{word}({number})" if number > 1 else word), len(phones.split())

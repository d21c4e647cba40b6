"""How words are pronounced: by the recogniser's dictionary, and by eSpeak NG's voices.

A word of the dictionary has its American pronunciations there. The voices add others' accents, and
pronounce the words that stand in no dictionary.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from pocketsphinx import get_model_path

from nondum_speech.arpabet import arpabet

ACCENTS = ("en-us", "en", "en-gb-x-rp", "en-gb-scotland", "en-gb-x-gbclan", "en-029")
"""Voices of eSpeak NG whose pronunciations are expected."""
MOST = 6
"""Pronunciations of one word: more make words alike."""
_LATIN = re.compile(r"[a-z0-9]")
_VARIANT = re.compile(r"\(\d+\)$")

Say = Callable[[str, str], str]
"""Word, voice → IPA."""


@dataclass(frozen=True, slots=True)
class Lexicon:
    """Pronunciations of some words."""

    pronunciations: Mapping[str, tuple[str, ...]]
    """Word → its pronunciations, phones with blanks between; likelier ones first."""
    guessed: tuple[str, ...]
    """Words that stand in no dictionary: eSpeak NG alone says how they are pronounced."""
    unsayable: tuple[str, ...]
    """Words that cannot be pronounced at all."""

    def to_dictionary(self) -> str:
        """In the form of the CMU dictionary."""
        return "".join(
            f"{word}{f'({n})' if n > 1 else ''} {phones}\n"
            for word, found in self.pronunciations.items()
            for n, phones in enumerate(found, 1)
        )


def lexicon(words: Iterable[str], say: Say, accents: Iterable[str] = ACCENTS) -> Lexicon:
    """Find out how words are pronounced."""
    known, accents = cmu_dictionary(), tuple(accents)
    found = {word: _pronunciations(word, known.get(word, ()), say, accents) for word in words}
    return Lexicon(
        pronunciations={word: phones for word, phones in found.items() if phones},
        guessed=tuple(word for word, phones in found.items() if phones and word not in known),
        unsayable=tuple(word for word, phones in found.items() if not phones),
    )


def _pronunciations(
    word: str, known: tuple[str, ...], say: Say, accents: tuple[str, ...]
) -> tuple[str, ...]:
    if not _LATIN.search(unicodedata.normalize("NFKD", word)):
        return ()  # the voices would spell it
    voices = (arpabet(say(word, accent)) for accent in accents)
    return tuple(dict.fromkeys((*known, *filter(None, voices))))[:MOST]


@cache
def cmu_dictionary() -> Mapping[str, tuple[str, ...]]:
    """The dictionary that the recogniser's wheel carries: word → pronunciations."""
    found: dict[str, tuple[str, ...]] = {}
    path = Path(get_model_path("en-us/cmudict-en-us.dict"))
    for line in path.read_text(encoding="utf-8").splitlines():
        word, _, phones = line.partition(" ")
        word = _VARIANT.sub("", word)
        found[word] = (*found.get(word, ()), phones.strip())
    return found

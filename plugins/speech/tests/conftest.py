"""What the tests share: one voice, and a recogniser of one small vocabulary."""

from __future__ import annotations

import pytest

from nondum_speech.espeak import Espeak
from nondum_speech.grammar import Vocabulary
from nondum_speech.lexicon import lexicon
from nondum_speech.recogniser import FreeHearing, Recogniser
from nondum_speech.settings import Settings

VOCABULARY = Vocabulary(
    (
        "[please] follow {class} [through {text}]",
        "[please] search for {class}",
        "[please] point at {target}",
        "[please] locate {target}",
    ),
    {"class": ("me", "people", "quadrotors"), "target": ("radiation source", "zorgon")},
)


@pytest.fixture(scope="session")
def espeak(tmp_path_factory: pytest.TempPathFactory) -> Espeak:
    """The one library of this process."""
    return Espeak(tmp_path_factory.mktemp("espeak"))


@pytest.fixture(scope="session")
def free() -> FreeHearing:
    """Decoders that hear anything."""
    return FreeHearing()


@pytest.fixture(scope="session")
def recogniser(espeak: Espeak, free: FreeHearing) -> Recogniser:
    """A recogniser of `VOCABULARY`, with the limits that are shipped."""
    words = lexicon(VOCABULARY.words, lambda word, voice: espeak.phonemes(word, voice=voice))
    return Recogniser(VOCABULARY, words, free, Settings().limits)

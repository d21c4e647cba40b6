"""A person who speaks and listens, by the speech payload's parts: eSpeak NG and PocketSphinx.

They run in no payload: sentences leave and enter as WAV files, in place of sound.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from demo.kit import PLUGINS

if TYPE_CHECKING:
    from nondum_speech.recogniser import Recogniser

VOICE = "en-us"
WORDS_PER_MINUTE = 150


class Person:
    """Says sentences, and understands those that they expect."""

    def __init__(self, scratch: Path, *, expects: Sequence[str]) -> None:
        """Takes half a second. `expects`: all that they tell apart, in small letters."""
        sys.path += [str(PLUGINS / name) for name in ("espeak", "speech")]
        from nondum_speech.espeak import Espeak

        scratch.mkdir()
        self._scratch = scratch
        self._espeak = Espeak(scratch)
        self._recogniser = self._made_recogniser(tuple(expects))

    def say(self, words: str, into: Path) -> Path:
        """Write a WAV file of what they say; answers the file."""
        sound = self._espeak.say(words, voice=VOICE, words_per_minute=WORDS_PER_MINUTE)
        into.write_bytes(sound.to_wav())
        return into

    def saying(self, words: str, name: str) -> Path:
        """The same, in a file of that name in their own folder."""
        return self.say(words, self._scratch / name)

    def understood(self, wav: Path) -> tuple[str, ...]:
        """The sentences in a WAV file that they expected; nothing for others."""
        from nondum_speech.sentences import sentences_of
        from nondum_speech.sound import read_wav

        heard = (self._recogniser.hear(sentence).said for sentence in sentences_of(read_wav(wav)))
        return tuple(filter(None, heard))

    def _made_recogniser(self, expects: tuple[str, ...]) -> Recogniser:
        from nondum_speech.grammar import Vocabulary
        from nondum_speech.lexicon import lexicon
        from nondum_speech.recogniser import FreeHearing, Recogniser
        from nondum_speech.settings import Settings

        vocabulary = Vocabulary(expects)
        words = lexicon(
            vocabulary.words, lambda word, voice: self._espeak.phonemes(word, voice=voice)
        )
        return Recogniser(vocabulary, words, FreeHearing(), Settings().limits)

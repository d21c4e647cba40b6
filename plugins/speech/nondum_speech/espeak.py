"""eSpeak NG's voices, as sound that the recogniser takes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from nondum_espeak import Espeak as Library
from nondum_speech.sound import Sound, resampled


class Espeak:
    """The library, ready. Methods block, and may be called from any thread."""

    def __init__(self, scratch: Path) -> None:
        """`scratch` is a folder to write to."""
        self._library = Library(scratch)

    def say(self, text: str, *, voice: str, words_per_minute: int) -> Sound:
        """Make the sound of a text. Raises `VoiceUnknown`."""
        spoken = self._library.say(text, voice=voice, words_per_minute=words_per_minute)
        return resampled(np.frombuffer(spoken.samples, np.int16), spoken.rate_hz)

    def phonemes(self, word: str, *, voice: str) -> str:
        """How a voice says a word, in IPA with `_` between phonemes. Raises `VoiceUnknown`."""
        return self._library.phonemes(word, voice=voice)

"""eSpeak NG's library, as its wheel carries it: text to sound, and words to phonemes.

https://github.com/espeak-ng/espeak-ng, speak_lib.h. The library keeps its state for itself, once in
a process: one thread at a time uses it.
"""

from __future__ import annotations

import ctypes
import io
import sys
import threading
import wave
from array import array
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import espeakng_loader

_SYNCHRONOUS = 2  # AUDIO_OUTPUT_SYNCHRONOUS: sound is given to the callback before the call returns
_DONT_EXIT = 0x8000
_UTF8 = 1
_IPA = 0x02
_RATE = 1  # espeakRATE
_LONGEST_PATH = 150
"""The library cuts off longer paths of its data, without a word."""
_IN_USE = threading.Lock()

_Callback = ctypes.CFUNCTYPE(
    ctypes.c_int, ctypes.POINTER(ctypes.c_short), ctypes.c_int, ctypes.c_void_p
)


class VoiceUnknown(ValueError):
    """eSpeak NG has no such voice."""


@dataclass(frozen=True, slots=True)
class Spoken:
    """A sentence: one channel of 16-bit samples in this machine's byte order."""

    samples: bytes
    rate_hz: int

    @property
    def seconds(self) -> float:
        """How long it is."""
        return len(self.samples) / 2 / self.rate_hz

    def to_wav(self) -> bytes:
        """A WAV file of it."""
        samples, file = array("h", self.samples), io.BytesIO()
        if sys.byteorder == "big":
            samples.byteswap()
        with wave.open(file, "wb") as wav:
            wav.setnchannels(1)
            wav.setsampwidth(2)
            wav.setframerate(self.rate_hz)
            wav.writeframes(samples.tobytes())
        return file.getvalue()


class Espeak:
    """The library, ready. Methods block, and may be called from any thread."""

    def __init__(self, scratch: Path) -> None:
        """`scratch` gets a link to its data where their own path is too long for it."""
        self._library = ctypes.CDLL(espeakng_loader.get_library_path())
        self._declare()
        data = _reachable(Path(espeakng_loader.get_data_path()), scratch)
        self._rate_hz = self._library.espeak_Initialize(_SYNCHRONOUS, 0, bytes(data), _DONT_EXIT)
        if self._rate_hz <= 0:
            raise OSError(f"eSpeak NG cannot use its data in {data}")
        self._sound = bytearray()
        self._callback = _Callback(self._take)  # the library keeps no reference

    def say(self, text: str, *, voice: str, words_per_minute: int) -> Spoken:
        """Make the sound of a text. Raises `VoiceUnknown`."""
        data = text.encode() + b"\0"
        with _IN_USE:
            self._choose(voice)
            self._library.espeak_SetSynthCallback(self._callback)
            self._library.espeak_SetParameter(_RATE, words_per_minute, 0)
            self._sound.clear()
            self._library.espeak_Synth(data, len(data), 0, 1, 0, _UTF8, None, None)
            return Spoken(bytes(self._sound), self._rate_hz)

    def phonemes(self, word: str, *, voice: str) -> str:
        """How a voice says a word, in IPA with `_` between phonemes. Raises `VoiceUnknown`."""
        with _IN_USE:
            self._choose(voice)
            text = ctypes.c_char_p(word.encode())
            said = self._library.espeak_TextToPhonemes(
                ctypes.byref(text), _UTF8, _IPA | ord("_") << 8
            )
        return str(said.decode())

    def _choose(self, voice: str) -> None:
        if self._library.espeak_SetVoiceByName(voice.encode()) != 0:
            raise VoiceUnknown(f"eSpeak NG has no voice {voice!r}")

    def _take(self, samples: Any, count: int, _events: int | None) -> int:
        if samples and count:
            self._sound += ctypes.string_at(samples, 2 * count)
        return 0

    def _declare(self) -> None:
        library, integer, text = self._library, ctypes.c_int, ctypes.c_char_p
        library.espeak_Initialize.argtypes = [integer, integer, text, integer]
        library.espeak_SetVoiceByName.argtypes = [text]
        library.espeak_SetParameter.argtypes = [integer, integer, integer]
        library.espeak_Synth.argtypes = [
            text, ctypes.c_size_t, ctypes.c_uint, integer, ctypes.c_uint, ctypes.c_uint,
            ctypes.c_void_p, ctypes.c_void_p,
        ]  # fmt: skip
        library.espeak_TextToPhonemes.argtypes = [ctypes.POINTER(text), integer, integer]
        library.espeak_TextToPhonemes.restype = text


def _reachable(data: Path, scratch: Path) -> Path:
    """A path of the data that is short enough for the library."""
    if len(bytes(data)) <= _LONGEST_PATH:
        return data
    link = scratch / "e"
    if not link.exists():
        link.symlink_to(data)
    return link

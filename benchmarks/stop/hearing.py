"""Stops that are said: heard by the speech plugin's ears, sample by sample as from a microphone."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import tempfile
import time
from collections.abc import AsyncIterator, Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from benchmarks.speech import VOICES
from benchmarks.stop.corpus import KNOWN, OTHERS
from benchmarks.stop.results import Hearing, Spoken

from nondum.planning.stop_words import STOPS, is_stop
from nondum_speech.ears import Ears
from nondum_speech.espeak import Espeak
from nondum_speech.settings import Settings
from nondum_speech.sound import RATE_HZ, Sound

NOISES_DB = (20, 10, 5)
"""White noise, so far below the voice."""
OWN_DB = (20, 10, 0)
"""The robot's own voice, so far below the person's, if it were listened to."""
OWN_WORDS = "I was asked to follow you, and I do, with the camera, the detector and the base."
OWN_VOICE = "en-us"
LEAD_S, TAIL_S = 1.0, 2.0
PIECE = RATE_HZ // 50
"""Samples that come at once from a microphone: 20 ms."""
WORDS_PER_MINUTE = 160
SILENT_PART = 0.02
"""Below such a part of the loudest sample a voice has ended."""
SPEAKS = "while the robot speaks (its ears are shut)"


Says = Callable[[str], None]
Waves = npt.NDArray[Any]


class Listener:
    """The plugin's ears, and what is said to them."""

    def __init__(self, espeak: Espeak) -> None:
        self._espeak = espeak
        self._noise = np.random.default_rng(7)
        log = logging.getLogger("benchmarks.stop")
        self._ears = Ears(espeak, log, Settings().limits)

    async def learn(self) -> None:
        """Know what a host with the shipped plugins tells."""
        await self._ears.learn(KNOWN)

    def said(self, text: str, voice: str) -> Sound:
        """A person's words."""
        return self._espeak.say(text, voice=voice, words_per_minute=WORDS_PER_MINUTE)

    async def heard(
        self,
        text: str,
        voice: str,
        *,
        noise_db: int | None = None,
        own_db: int | None = None,
        is_speaking: bool = False,
    ) -> Spoken:
        """Say something under noise, or the robot's own voice, or while it speaks."""
        said = self.said(text, voice)
        end = int(LEAD_S * RATE_HZ) + _end(said)
        samples = _among_silence(said)
        level = float(np.std(said.samples))
        if noise_db is not None:
            samples = samples + self._noise.normal(0, _below(level, noise_db), len(samples))
        if own_db is not None:
            samples = samples + self._own(len(samples), _below(level, own_db))
        whole = np.clip(samples, -32768, 32767).astype(np.int16)
        shut = self._ears.deafened() if is_speaking else contextlib.nullcontext()
        with shut:
            return await self._attended(whole, end, text, voice)

    async def _attended(self, samples: Waves, end: int, text: str, voice: str) -> Spoken:
        found: list[tuple[str, float, float]] = []
        queue = self._ears.sentences

        async def pieces() -> AsyncIterator[bytes]:
            for start in range(0, len(samples), PIECE):
                piece = samples[start : start + PIECE]
                began_s = time.perf_counter()
                yield piece.tobytes()
                took_s = time.perf_counter() - began_s  # asked for more: it has heard that
                while not queue.empty():
                    late_s = (start + len(piece) - end) / RATE_HZ
                    found.append((queue.get_nowait(), late_s + took_s, late_s))

        await self._ears.attend(pieces())
        stops = [one for one in found if is_stop(one[0])]
        if not found:
            return Spoken(text, voice, None, is_stop=False)
        heard, after_s, sound_s = (stops or found)[0]
        return Spoken(text, voice, heard, bool(stops), after_s, sound_s)

    def _own(self, length: int, level: float) -> Waves:
        own = self.said(OWN_WORDS, OWN_VOICE).samples.astype(np.float64)
        repeated = np.resize(own, length)
        return repeated * (level / max(1.0, float(np.std(own))))


async def measured(
    espeak: Espeak, voices: Sequence[str], sentences: Sequence[str], say: Says
) -> list[Hearing]:
    """Every word and sentence by every voice, in each circumstance."""
    listener = Listener(espeak)
    await listener.learn()

    async def heard(texts: Sequence[str], **how: Any) -> tuple[Spoken, ...]:
        return tuple([await listener.heard(t, v, **how) for t in texts for v in voices])

    found = []
    for noise_db in (None, *NOISES_DB):
        name = "quiet" if noise_db is None else f"white noise, {noise_db} dB below"
        say(f"spoken: {name}")
        stops = await heard(STOPS, noise_db=noise_db)
        found.append(Hearing(name, stops, await heard(sentences, noise_db=noise_db)))
    say(f"spoken: {SPEAKS}")
    found.append(Hearing(SPEAKS, await heard(STOPS, is_speaking=True)))
    for own_db in OWN_DB:
        name = f"its own voice, {own_db} dB below, if its ears were open"
        say(f"spoken: {name}")
        found.append(Hearing(name, await heard(STOPS, own_db=own_db)))
    return found


def run(voices: int, sentences: int | None, say: Says) -> list[Hearing]:
    """Measure with the first so many voices, and so many of the other sentences (None: all)."""
    others = OTHERS if sentences is None else OTHERS[:: max(1, len(OTHERS) // sentences)]
    with tempfile.TemporaryDirectory() as scratch:
        return asyncio.run(measured(Espeak(Path(scratch)), VOICES[:voices], others, say))


def _end(sound: Sound) -> int:
    """The sample after the last that is voice."""
    loud = np.abs(sound.samples.astype(np.int32))
    heard = np.flatnonzero(loud > SILENT_PART * loud.max(initial=1))
    return int(heard[-1]) + 1 if len(heard) else 0


def _among_silence(sound: Sound) -> Waves:
    lead, tail = (np.zeros(int(seconds * RATE_HZ)) for seconds in (LEAD_S, TAIL_S))
    return np.concatenate([lead, sound.samples.astype(np.float64), tail])


def _below(level: float, decibels: float) -> float:
    return float(level / 10 ** (decibels / 20))

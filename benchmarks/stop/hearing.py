"""Spoken stops: the speech plugin's listener gets them sample by sample as from a microphone."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import logging
import tempfile
import time
from collections.abc import AsyncIterator, Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from benchmarks.speech import VOICES
from benchmarks.stop.corpus import HOST, KNOWN, OF_ROBOT, OTHERS
from benchmarks.stop.results import Hearing, Spoken
from benchmarks.stop.room import Room

from nondum.planning.words.addressee import addressed_to
from nondum.planning.words.stop_words import STOPS, host_behind_stop, is_stop
from nondum_speech.espeak import Espeak
from nondum_speech.listener import SpeechListener
from nondum_speech.settings import Settings
from nondum_speech.sound import RATE_HZ, Sound

NOISES_DB = (20, 10, 5)
"""White noise, so far below the voice."""
OWN_DB = (10, 0, -10)
"""The robot's own voice at its microphone, so far below the person's."""
OWN_LEVEL, HISS_LEVEL = 400.0, 4.0
"""Root mean square of the robot's voice at its microphone, and of a room's hiss."""
BEFORE = 3
"""How many sentences the robot has said before anything is measured."""
INTERRUPTS_S = (0.5, 2.0)
"""A person begins so long after the robot's voice is heard, or before it ends."""
LEAD_S, TAIL_S = 1.0, 2.0
PIECE = RATE_HZ // 50
"""Samples that come at once from a microphone: 20 ms."""
WORDS_PER_MINUTE = 160
SILENT_PART = 0.02
"""Below such a part of the loudest sample a voice has ended."""
ALONE = "only the robot speaks"

Says = Callable[[str], None]
Waves = npt.NDArray[Any]


@dataclass(frozen=True, slots=True)
class Scene:
    """What comes from the microphone, and what of it is whose, in samples."""

    samples: Waves
    begin: int
    """Where the person's words begin, and end."""
    end: int
    own: Sound | None = None
    """What the robot says, from the first sample on, and until when."""
    own_end: int = 0


class Listener:
    """The plugin's listener, and what is said to it."""

    def __init__(self, espeak: Espeak) -> None:
        self._espeak = espeak
        log = logging.getLogger("benchmarks.stop")
        self._listener = SpeechListener(espeak, log, Settings().limits, listens_on=True)
        self._room = Room(7)
        self._chance = np.random.default_rng(7)
        self._own = itertools.cycle(OF_ROBOT)

    async def learn(self) -> None:
        """Know what a host with the shipped plugins tells, and how the own voice is heard."""
        await self._listener.learn(KNOWN)
        for _ in range(BEFORE):
            await self.alone(next(self._own))

    def said(self, text: str, voice: str) -> Sound:
        """A person's words."""
        return self._espeak.say(text, voice=voice, words_per_minute=WORDS_PER_MINUTE)

    async def spoken(self, text: str, voice: str, *, noise_db: int | None = None) -> Spoken:
        """Say something, perhaps under noise."""
        said = self.said(text, voice)
        samples = _among_silence(said)
        if noise_db is not None:
            level = _below(float(np.std(said.samples)), noise_db)
            samples = samples + self._chance.normal(0, level, len(samples))
        begin = int(LEAD_S * RATE_HZ)
        return await self._attended(Scene(samples, begin, begin + _end(said)), text, voice)

    async def spoken_over(self, text: str, voice: str, *, own_db: int) -> Spoken:
        """Say something while the robot speaks, whose voice is `own_db` weaker."""
        said = self.said(text, voice)
        own, heard, start = self._spoken_by_robot(next(self._own))
        words = self._room.person(said.samples.astype(np.float64))
        words *= OWN_LEVEL * 10 ** (own_db / 20) / max(1.0, float(np.std(words)))
        latest = max(start, start + len(own.samples) - len(said.samples))
        begin = min(start + int(RATE_HZ * self._chance.uniform(*INTERRUPTS_S)), latest)
        samples = np.zeros(max(len(heard), begin + len(words)) + int(TAIL_S * RATE_HZ))
        samples[: len(heard)] += heard
        samples[begin : begin + len(words)] += words
        scene = Scene(samples, begin, begin + _end(said), own, start + len(own.samples))
        return await self._attended(scene, text, voice)

    async def alone(self, text: str) -> Spoken:
        """Have the robot say something while no person speaks."""
        own, heard, start = self._spoken_by_robot(text)
        scene = Scene(np.pad(heard, (0, RATE_HZ)), 0, len(heard), own, start + len(own.samples))
        return await self._attended(scene, text, Settings().voice)

    def _spoken_by_robot(self, text: str) -> tuple[Sound, Waves, int]:
        """What it plays, what is heard of it, and from which sample on."""
        own = self.said(text, Settings().voice)
        start = int(self._room.start_s() * RATE_HZ)
        heard = self._room.own(own.samples.astype(np.float64))
        heard *= OWN_LEVEL / max(1.0, float(np.std(own.samples)))
        heard = np.pad(heard, (start, 0))
        return own, heard + self._chance.normal(0, HISS_LEVEL, len(heard)), start

    async def _attended(self, scene: Scene, text: str, voice: str) -> Spoken:
        found: list[tuple[str, float, float]] = []
        queue = self._listener.sentences
        samples = np.clip(scene.samples, -32768, 32767).astype("<i2")

        async def pieces() -> AsyncIterator[bytes]:
            with contextlib.ExitStack() as saying:
                if scene.own is not None:
                    saying.enter_context(self._listener.saying(scene.own))
                for start in range(0, len(samples), PIECE):
                    if start >= scene.own_end:
                        saying.close()
                    piece = samples[start : start + PIECE]
                    began_s = time.perf_counter()
                    yield piece.tobytes()
                    took_s = time.perf_counter() - began_s  # asked for more: it has heard that
                    while not queue.empty():
                        words, until = queue.get_nowait(), start + len(piece)
                        late_s = (until - scene.end) / RATE_HZ
                        if until > scene.begin:
                            found.append((words, late_s + took_s, late_s))

        await self._listener.attend(pieces())
        stops = [one for one in found if _is_stop(one[0])]
        if not found:
            return Spoken(text, voice, None, is_stop=False)
        heard, after_s, sound_s = (stops or found)[0]
        return Spoken(text, voice, heard, bool(stops), after_s, sound_s)


async def measured(
    espeak: Espeak, voices: Sequence[str], sentences: Sequence[str], say: Says
) -> list[Hearing]:
    """Every word and sentence by every voice, in each circumstance."""
    listener = Listener(espeak)
    await listener.learn()

    async def spoken(texts: Sequence[str], noise_db: int | None) -> tuple[Spoken, ...]:
        return tuple(
            [await listener.spoken(t, v, noise_db=noise_db) for t in texts for v in voices]
        )

    async def spoken_over(texts: Sequence[str], own_db: int) -> tuple[Spoken, ...]:
        return tuple(
            [await listener.spoken_over(t, v, own_db=own_db) for t in texts for v in voices]
        )

    found = []
    for noise_db in (None, *NOISES_DB):
        name = "quiet" if noise_db is None else f"white noise, {noise_db} dB below"
        say(f"spoken: {name}")
        stops = await spoken(STOPS, noise_db)
        found.append(Hearing(name, stops, await spoken(sentences, noise_db)))
    for own_db in OWN_DB:
        name = f"while the robot speaks, its voice {_told(own_db)}"
        say(f"spoken: {name}")
        stops = await spoken_over(STOPS, own_db)
        found.append(Hearing(name, stops, await spoken_over(sentences, own_db)))
    say(f"spoken: {ALONE}")
    found.append(Hearing(ALONE, (), tuple([await listener.alone(text) for text in OF_ROBOT])))
    return found


def run(voices: int, sentences: int | None, say: Says) -> list[Hearing]:
    """Measure with the first `voices` voices and that many other sentences (None: all)."""
    others = OTHERS if sentences is None else OTHERS[:: max(1, len(OTHERS) // sentences)]
    with tempfile.TemporaryDirectory() as scratch:
        return asyncio.run(measured(Espeak(Path(scratch)), VOICES[:voices], others, say))


def _is_stop(words: str) -> bool:
    """Whether the host would stop, called by its name or not."""
    return is_stop(addressed_to(words, [HOST])[1]) or host_behind_stop(words, [HOST]) is not None


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


def _told(decibels: int) -> str:
    """How loud the robot's voice is, next to the person's.

    >>> _told(10), _told(0), _told(-10)
    ('10 dB below', 'as loud', '10 dB above')
    """
    return f"{abs(decibels)} dB {'below' if decibels > 0 else 'above'}" if decibels else "as loud"

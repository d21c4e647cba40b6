"""Recognises sentences, one after the other, from files and from a microphone.

Words change while people speak: a sentence is heard by what could be said when it ended. While this
machine itself speaks, no sentences are heard, only words that stop.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import AsyncIterator, Iterator
from pathlib import Path

from nondum_speech.espeak import Espeak
from nondum_speech.grammar import Vocabulary
from nondum_speech.inbox import Inbox, may_grow
from nondum_speech.lexicon import lexicon
from nondum_speech.recogniser import Limits
from nondum_speech.recognising import RecogniserEnded, Recognising
from nondum_speech.sentences import Sentences, sentences_of
from nondum_speech.sound import Sound, SoundInvalid, from_bytes, read_wav

LOOK_S = 0.2
WAITING = 8
"""How many sentences wait for a host that does not ask; beyond that the oldest is forgotten."""
ECHO_BYTES = 16_000
"""Half a second: so long after the own voice has ended, its echo may be heard."""


class SpeechListener:
    """Turns sounds into sentences, which wait in `sentences`."""

    def __init__(
        self, espeak: Espeak, log: logging.Logger, limits: Limits, *, listens_on: bool
    ) -> None:
        """`listens_on`: words that stop are listened for while this machine speaks."""
        self.sentences: asyncio.Queue[str] = asyncio.Queue()
        self._espeak, self._log = espeak, log
        self._recognising = Recognising(limits)
        self._learnt = asyncio.Event()
        self._listens_on = listens_on
        self._saying: Sound | None = None

    async def learn(self, vocabulary: Vocabulary) -> None:
        """Hear other words from now on; tell which ones cannot be heard well."""
        words = await asyncio.to_thread(lexicon, vocabulary.words, self._pronounced)
        if words.guessed:
            self._log.info("in no dictionary, pronounced by rule: %s", ", ".join(words.guessed))
        if words.unsayable:
            told = ", ".join(words.unsayable)
            self._log.warning("phrases and names with these words cannot be heard: %s", told)
        await self._recognising.learn(vocabulary, words)
        self._learnt.set()
        self._log.info("%d phrases can be heard", len(vocabulary.phrases))

    async def close(self) -> None:
        """Hear nothing any more."""
        await self._recognising.close()

    async def watch(self, inbox: Inbox) -> None:
        """Hear the files that are put into a folder, for ever."""
        await self._learnt.wait()
        while True:
            for path in inbox.waiting():
                try:
                    await self._hear_file(inbox, path)
                except OSError as error:  # it has gone, or cannot be marked as heard
                    with contextlib.suppress(FileNotFoundError):
                        inbox.give_up(path)
                        self._log.warning("%s is not heard: %s", path.name, error)
            await asyncio.sleep(LOOK_S)

    async def attend(self, pieces: AsyncIterator[bytes]) -> None:
        """Hear a flow of samples, as long as it flows; of the own voice nothing is understood."""
        cutter, own, echo = Sentences(), None, 0
        async for piece in pieces:
            if self._saying is not None:
                if self._saying is not own:
                    cutter, own = Sentences(), self._saying
                    await self._begin(own)
                echo = ECHO_BYTES
                await self._hear_stop(piece)
            elif echo > 0:
                echo -= len(piece)
                await self._hear_stop(piece)
            else:
                own = None
                for sentence in cutter.feed(piece):
                    await self._hear(sentence)

    @contextlib.contextmanager
    def saying(self, sound: Sound) -> Iterator[None]:
        """Understand no sentences from a microphone: this machine says `sound`, of goals too."""
        self._saying = sound
        try:
            yield
        finally:
            self._saying = None

    async def _hear_file(self, inbox: Inbox, path: Path) -> None:
        try:
            sound = await asyncio.to_thread(read_wav, path)
        except SoundInvalid as invalid:
            if may_grow(path):
                return
            self._log.warning("%s cannot be heard: %s", path.name, invalid)
            inbox.take(path)
            return
        inbox.take(path)
        for sentence in await asyncio.to_thread(sentences_of, sound):
            await self._hear(sentence)

    async def _hear(self, sentence: Sound) -> None:
        try:
            heard = await self._recognising.hear(sentence)
        except RecogniserEnded as ended:
            self._log.warning("a sentence of %.1f s was not heard: %s", sentence.seconds, ended)
            return
        if not heard.said:
            near = (
                f"; the nearest is {heard.words!r} ({heard.confidence:.2f})" if heard.words else ""
            )
            self._log.info("heard %.1f s of no known sentence%s", sentence.seconds, near)
            return
        self._log.info("heard %r (%.2f)", heard.said, heard.confidence)
        self._keep(heard.said)

    async def _begin(self, own: Sound) -> None:
        if self._listens_on:
            with contextlib.suppress(RecogniserEnded):  # what comes next tells it
                await self._recognising.says(own)

    async def _hear_stop(self, piece: bytes) -> None:
        """Of what is heard while this machine speaks, hear words that stop."""
        if not self._listens_on:
            return
        try:
            words = await self._recognising.stop_in(from_bytes(piece))
        except RecogniserEnded as ended:
            self._log.warning("words that stop were not listened for: %s", ended)
            return
        if words:
            self._log.info("heard %r while speaking", words)
            self._keep(words)

    def _keep(self, words: str) -> None:
        if self.sentences.qsize() == WAITING:
            self.sentences.get_nowait()
        self.sentences.put_nowait(words)

    def _pronounced(self, word: str, accent: str) -> str:
        return self._espeak.phonemes(word, voice=accent)

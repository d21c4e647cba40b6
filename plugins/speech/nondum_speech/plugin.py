"""Hears goals and says sentences, offline."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from nondum.sdk import ConfigRefused, Context, Problem, hookimpl
from nondum.sdk.settings import parse_settings
from nondum_espeak import Outlet, VoiceUnknown, find_outlet
from nondum_speech.espeak import Espeak
from nondum_speech.grammar import Vocabulary
from nondum_speech.inbox import Inbox
from nondum_speech.listener import SpeechListener
from nondum_speech.microphone import MicrophoneSilent, find_recorder, recorded
from nondum_speech.settings import Settings
from nondum_speech.sound import Sound

AGAIN_S = 5.0
"""A microphone that was pulled is looked for so often."""


class Speech:
    """The plugin: one voice, and one listener."""

    def __init__(self) -> None:
        self._settings = Settings()
        self._listener: SpeechListener | None = None
        self._espeak: Espeak | None = None
        self._outlet: Outlet | None = None
        self._one_voice = asyncio.Lock()

    @hookimpl
    def describe(self) -> dict[str, str]:
        """What it is."""
        return {"summary": "Hears goals and says sentences, offline."}

    @hookimpl
    async def start(self, ctx: Context) -> None:
        """Refuse wrong settings; begin to hear; tell once what is not here."""
        settings = parse_settings(Settings, ctx.settings, where=ctx.component)
        self._settings = settings
        self._espeak = Espeak(ctx.scratch)
        await self._try_voice(ctx.component)
        self._outlet = find_outlet(settings.said, os.environ, scratch=ctx.scratch)
        if self._outlet is None:
            ctx.log.info("no sound player is here: what is said will be printed only")
        listens = settings.stop_while_speaking
        self._listener = SpeechListener(self._espeak, ctx.log, settings.limits, listens_on=listens)
        inbox = Inbox(Path(settings.inbox) if settings.inbox else ctx.scratch / "inbox")
        ctx.log.info("WAV files in %s are heard", inbox.folder)
        ctx.spawn(self._listener.watch(inbox))
        if settings.microphone:
            ctx.spawn(_attend(ctx, self._listener, settings.microphone))

    @hookimpl
    async def stop(self, ctx: Context) -> None:
        """End the recogniser."""
        if self._listener is not None:
            await self._listener.close()

    @hookimpl
    async def learn_words(self, ctx: Context, vocabulary: Mapping[str, Any]) -> None:
        """Hear what can be said now, and nothing else."""
        if self._listener is not None:
            names = {slot: tuple(words) for slot, words in vocabulary["names"].items()}
            phrases, stops = vocabulary["phrases"], vocabulary.get("stops", ())
            await self._listener.learn(Vocabulary(tuple(phrases), names, tuple(stops)))

    @hookimpl
    async def listen(self, ctx: Context) -> dict[str, str]:
        """Wait for a sentence."""
        assert self._listener is not None, "asked only once started"
        return {"words": await self._listener.sentences.get()}

    @hookimpl
    async def speak(self, ctx: Context, text: str) -> None:
        """Say anything, one sentence at a time; only words that stop are heard meanwhile."""
        assert self._listener is not None, "asked only once started"
        ctx.log.info("says: %s", text)
        if self._outlet is None:
            return
        async with self._one_voice:
            sound = await self._sound(text)
            with self._listener.saying(sound):
                try:
                    await self._outlet.play(sound.to_wav())
                except (OSError, TimeoutError) as error:
                    ctx.log.warning("that was not heard: %s", error)

    async def _sound(self, text: str) -> Sound:
        assert self._espeak is not None, "asked only once started"
        voice, speed = self._settings.voice, self._settings.words_per_minute
        return await asyncio.to_thread(self._espeak.say, text, voice=voice, words_per_minute=speed)

    async def _try_voice(self, where: str) -> None:
        """Raise `ConfigRefused` for a voice that there is not."""
        try:
            await self._sound("")
        except VoiceUnknown as unknown:
            raise ConfigRefused(Problem("SETTING_INVALID", str(unknown), where=where)) from unknown


async def _attend(ctx: Context, listener: SpeechListener, device: str) -> None:
    """Hear a microphone, and look for it again when it is gone; told once each time."""
    told = ""
    while True:
        why = "there is no arecord, or nothing to record from"
        if recorder := find_recorder(os.environ):
            try:
                await listener.attend(recorded(recorder, device))
            except MicrophoneSilent as silent:
                why = str(silent)
        if why != told:
            ctx.log.info("no microphone is listened to: %s", why)
            told = why
        await ctx.sleep(AGAIN_S)

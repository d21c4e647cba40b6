"""Says things: aloud where it can, and in the log."""

from __future__ import annotations

import asyncio
import os

from nondum.sdk import ConfigRefused, Context, Fragment, Phrase, Problem, Unit, behaviour, hookimpl
from nondum.sdk.settings import parse_settings
from nondum_espeak import Espeak, Outlet, VoiceUnknown, find_outlet
from nondum_speaker.settings import Settings


class Speaker:
    """The plugin: one voice."""

    def __init__(self) -> None:
        self._settings = Settings()
        self._espeak: Espeak | None = None
        self._outlet: Outlet | None = None
        self._one_voice = asyncio.Lock()

    @hookimpl
    def describe(self) -> dict[str, str]:
        """What it is."""
        return {"summary": "Says what was found, aloud where it can."}

    @hookimpl
    def units(self) -> tuple[Unit, ...]:
        """What acts."""
        return (Unit("voice", "speaker", users=1),)

    @hookimpl
    def fragments(self) -> tuple[Fragment, ...]:
        """What it can do for a plan."""
        return (Fragment.from_package("nondum_speaker", "domain.pddl"),)

    @hookimpl
    def phrases(self) -> tuple[Phrase, ...]:
        """How people ask for it: who asks again wants to know what is there now, so that what was
        found before does not count."""
        patterns = (
            "[please] report {c:class}",
            "[please] tell me of {c:class}",
            "[please] search for {c:class} [and tell me]",
        )
        goal = "(and (found ?c self) (reported ?c self))"
        return tuple(Phrase(pattern, goal, kind="do") for pattern in patterns)

    @hookimpl
    async def start(self, ctx: Context) -> None:
        """Refuse wrong settings; tell once when nothing will be heard."""
        self._settings = parse_settings(Settings, ctx.settings, where=ctx.component)
        self._espeak = await asyncio.to_thread(Espeak, ctx.scratch)
        try:
            await self._wav("")
        except VoiceUnknown as unknown:
            problem = Problem("SETTING_INVALID", str(unknown), where=ctx.component)
            raise ConfigRefused(problem) from unknown
        self._outlet = find_outlet(self._settings.said, os.environ, scratch=ctx.scratch)
        if self._settings.said:
            ctx.log.info("what is said is written to %s", ctx.scratch / self._settings.said)
        elif self._outlet is None:
            ctx.log.info("no sound player is here: what is said will be printed only")

    @behaviour("report", action="(report ?u - speaker ?c - class ?h - host)")
    async def report(self, ctx: Context, u: str, c: str, h: str) -> None:
        """Say that something was found."""
        await self._say(ctx, self._settings.sentence(c))

    @hookimpl
    async def speak(self, ctx: Context, text: str) -> None:
        """Say anything."""
        await self._say(ctx, text)

    async def _say(self, ctx: Context, text: str) -> None:
        """Print always: a sentence that no one heard can still be read in the log."""
        ctx.log.info("says: %s", text)
        if self._outlet is None:
            return
        async with self._one_voice:
            try:
                await self._outlet.play(await self._wav(text))
            except (OSError, TimeoutError) as error:
                ctx.log.warning("that was not heard: %s", error)

    async def _wav(self, text: str) -> bytes:
        assert self._espeak is not None, "asked only once started"
        voice, speed = self._settings.voice, self._settings.words_per_minute
        spoken = await asyncio.to_thread(
            self._espeak.say, text, voice=voice, words_per_minute=speed
        )
        return spoken.to_wav()

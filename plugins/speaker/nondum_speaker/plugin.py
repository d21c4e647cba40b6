"""Says things: aloud by espeak-ng where it can, else in the log."""

from __future__ import annotations

import os

from nondum.sdk import Context, Fragment, Phrase, Unit, behaviour, hookimpl
from nondum.sdk.settings import parse_settings
from nondum_speaker.settings import Settings
from nondum_speaker.voice import find_voice


@hookimpl
def describe() -> dict[str, str]:
    return {"summary": "Says what was found, aloud where it can."}


@hookimpl
def units() -> tuple[Unit, ...]:
    return (Unit("voice", "speaker", users=1),)


@hookimpl
def fragments() -> tuple[Fragment, ...]:
    return (Fragment.from_package("nondum_speaker", "domain.pddl"),)


@hookimpl
def phrases() -> tuple[Phrase, ...]:
    patterns = ("[please] report {c:class}", "[please] tell me of {c:class}")
    return tuple(Phrase(pattern, "(reported ?c self)") for pattern in patterns)


@hookimpl
async def start(ctx: Context) -> None:
    """Refuse wrong settings; tell once when nothing will be heard."""
    parse_settings(Settings, ctx.settings, where=ctx.component)
    voice = find_voice(os.environ)
    for what, there in (("espeak-ng", voice.synthesiser), ("a sound player", voice.player)):
        if there is None:
            ctx.log.info("%s is not here: what is said will be printed only", what)


@behaviour("report", action="(report ?u - speaker ?c - class ?h - host)")
async def report(ctx: Context, u: str, c: str, h: str) -> None:
    """Say that something was found."""
    settings = parse_settings(Settings, ctx.settings, where=ctx.component)
    await _say(ctx, settings.sentence(c), settings)


@hookimpl
async def speak(ctx: Context, text: str) -> None:
    """Say anything."""
    await _say(ctx, text, parse_settings(Settings, ctx.settings, where=ctx.component))


async def _say(ctx: Context, text: str, settings: Settings) -> None:
    """Print always: a sentence that nobody heard can still be read in the log."""
    ctx.log.info("says: %s", text)
    voice = find_voice(os.environ)
    await voice.say(text, language=settings.language, words_per_minute=settings.words_per_minute)

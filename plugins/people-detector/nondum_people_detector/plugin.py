"""Finds people in any stream of images."""

from __future__ import annotations

import asyncio

from nondum.sdk import Context, Fragment, Label, Output, Unit, behaviour, hookimpl
from nondum.sdk.settings import parse_settings
from nondum_people_detector.detection import detect, detector
from nondum_people_detector.settings import Settings


@hookimpl
def describe() -> dict[str, str]:
    return {"summary": "Finds people in any stream of images."}


@hookimpl
def units() -> tuple[Unit, ...]:
    return (Unit("detector", "detector", outputs=(Output("people", "detections"),)),)


@hookimpl
def fragments() -> tuple[Fragment, ...]:
    names = ("domain.pddl", "problem.pddl")
    return tuple(Fragment.from_package("nondum_people_detector", name) for name in names)


@hookimpl
def labels() -> tuple[Label, ...]:
    return tuple(Label("person", words) for words in ("me", "people", "persons", "a person"))


@hookimpl
async def start(ctx: Context) -> None:
    """Refuse wrong settings, and weights that cannot be read, before anybody plans with them."""
    await asyncio.to_thread(detector, parse_settings(Settings, ctx.settings, where=ctx.component))


@behaviour(
    "detect",
    action="(detect ?u - detector ?i - image ?o - detections ?h - host ?c - class)",
    lasting=True,
)
async def detect_people(ctx: Context, u: str, i: str, o: str, h: str, c: str) -> None:
    """Find people in the newest image, over and over, until halted."""
    settings = parse_settings(Settings, ctx.settings, where=ctx.component)
    finder = await asyncio.to_thread(detector, settings)
    output, is_established = ctx.output(o), False
    async for image in ctx.input(i):
        found = await asyncio.to_thread(
            detect, finder, image, is_probability=bool(settings.weights)
        )
        output.send(found)
        if not is_established:
            await ctx.established()
            is_established = True

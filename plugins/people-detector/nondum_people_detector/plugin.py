"""Finds people in any stream of images."""

from __future__ import annotations

import asyncio

from nondum.sdk import Context, Fragment, Label, Output, ThreadContext, Unit, behaviour, hookimpl
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
def start(ctx: ThreadContext) -> None:
    """Refuse wrong settings before anybody plans with them."""
    parse_settings(Settings, ctx.settings, where=ctx.component)


@behaviour(
    "detect",
    action="(detect ?u - detector ?i - image ?o - detections ?h - host ?c - class)",
    lasting=True,
)
async def detect_people(ctx: Context, u: str, i: str, o: str, h: str, c: str) -> None:
    """Find people in the newest image, over and over, until halted; by other weights from the image
    on before which those are shown.

    Fails with WEIGHTS_UNREADABLE.
    """
    settings = parse_settings(Settings, ctx.settings, where=ctx.component)
    weights = ctx.data("weights")
    finder = await asyncio.to_thread(detector, settings, weights.path if weights else None)
    output, is_established = ctx.output(o), False
    async for image in ctx.input(i):
        if (shown := ctx.data("weights")) != weights:
            weights = shown
            finder = await asyncio.to_thread(detector, settings, weights.path if weights else None)
        found = await asyncio.to_thread(detect, finder, image, is_probability=weights is not None)
        output.send(found)
        if not is_established:
            await ctx.established()
            is_established = True

"""Spots pedestrians in any stream of images."""

from __future__ import annotations

import asyncio

from nondum.sdk import Context, Fragment, Label, Output, Unit, behaviour, hookimpl
from nondum.sdk.settings import parse_settings
from nondum_pedestrian_detector.settings import Settings
from nondum_pedestrian_detector.spotter import Spotter


@hookimpl
def describe() -> dict[str, str]:
    return {"summary": "Finds pedestrians in images, quickly and from some way off."}


@hookimpl
def units() -> tuple[Unit, ...]:
    return (Unit("spotter", "detector", outputs=(Output("pedestrians", "detections"),)),)


@hookimpl
def fragments() -> tuple[Fragment, ...]:
    names = ("domain.pddl", "problem.pddl")
    return tuple(Fragment.from_package("nondum_pedestrian_detector", name) for name in names)


@hookimpl
def labels() -> tuple[Label, ...]:
    return tuple(Label("person", words) for words in ("me", "pedestrians", "a pedestrian"))


@hookimpl
async def start(ctx: Context) -> None:
    """Refuse wrong settings before anybody plans with them."""
    parse_settings(Settings, ctx.settings, where=ctx.component)


@behaviour(
    "spot",
    action="(spot ?u - detector ?i - image ?o - detections ?h - host ?c - class)",
    lasting=True,
)
async def spot(ctx: Context, u: str, i: str, o: str, h: str, c: str) -> None:
    """Find pedestrians in the newest image, over and over, until halted."""
    spotter = Spotter(parse_settings(Settings, ctx.settings, where=ctx.component))
    images, output = ctx.input(i), ctx.output(o)
    output.send(await asyncio.to_thread(spotter.spot, await images.next(), c))
    await ctx.established()
    async for image in images:
        output.send(await asyncio.to_thread(spotter.spot, image, c))

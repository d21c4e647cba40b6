"""Workers that make frames and workers that see them."""

from __future__ import annotations

from tests.kit.workers import WorkersUnderTest

from nondum.host.core.events.facts import FactKnown
from nondum.sdk.description import Behaviour

CAMERA = """
import asyncio
from nondum.sdk import Header, Image, Output, Unit, behaviour, hookimpl

@hookimpl
def units():
    return (Unit("camera", "camera", outputs=(Output("frames", "image"),)),)

@behaviour("stream", action="(stream ?u - camera ?o - image)", lasting=True)
async def stream(ctx, u, o):
    output = ctx.output(o)
    number = 0
    await ctx.established()
    while True:
        number += 1
        header = Header(frame_id=u, seq=number)
        output.send(Image(header, 480, 640, "bgr8", 1920, bytes([number % 256]) * 921_600, None))
        if number % 20 == 0:
            ctx.know("sent", ctx.component, str(number))
        await asyncio.sleep(0.01)
"""


WATCHER = """
from nondum.sdk import Unit, behaviour, hookimpl

@hookimpl
def units():
    return (Unit("eye", "detector"),)

@behaviour("watch", action="(watch ?u - detector ?i - image)", lasting=True)
async def watch(ctx, u, i):
    count = 0
    async for image in ctx.input(i):
        assert len(image.data) == 921_600 and image.data[0] == image.header.seq % 256
        count += 1
        if count == 1:
            await ctx.established()
        if count % 10 == 0:
            ctx.know("seen", ctx.component, str(count), image.header.frame_id)
"""


STREAM = Behaviour("stream", "(stream ?u - camera ?o - image)", lasting=True)


WATCH = Behaviour("watch", "(watch ?u - detector ?i - image)", lasting=True)


async def sees(tested: WorkersUnderTest, name: str, count: int = 30) -> FactKnown:
    """Wait until a watcher has seen `count` further frames."""
    seen = sum(1 for e in tested.told(FactKnown) if e.predicate == "seen" and e.component == name)
    wanted = str((seen + 1) * 10 + count)
    return await tested.until(FactKnown, lambda e: e.arguments[:2] == (name, wanted))

"""Frames between real workers: wired by what a call reads, dropped for whoever cannot keep up."""

from __future__ import annotations

import asyncio
import os
import signal
from collections.abc import Callable

import pytest
from tests.kit.house import HOST, House

from nondum.host.events import BehaviourEstablished, FactKnown, StreamFlowing, WorkerReady
from nondum.host.workers import Call
from nondum.planning.running import RunState
from nondum.sdk.description import Behaviour, Input, Output, Unit

pytestmark = pytest.mark.anyio

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
ODOMETER = """
import asyncio
from nondum.sdk import Header, Output, Pose, Unit, hookimpl

@hookimpl
def units():
    return (Unit("wheels", "base", outputs=(Output("odometry", "pose", always=True),)),)

@hookimpl
async def start(ctx):
    ctx.spawn(turn(ctx))

async def turn(ctx):
    output = ctx.output("odometry")
    while True:
        output.send(Pose(Header(frame_id=ctx.host), (1.0, 2.0, 0.0), (0.0, 0.0, 0.0, 1.0)))
        await asyncio.sleep(0.02)
"""
PANNER = """
from nondum.sdk import Input, Unit, behaviour, hookimpl

@hookimpl
def units():
    return (Unit("reader", "sensor", inputs=(Input("odometry", "pose"),)),)

@behaviour("read", action="(read ?u - sensor)")
async def read(ctx, u):
    pose = await ctx.optional_input("odometry").next(10.0)
    ctx.know("at", str(pose.position[1]))
"""
STREAM = Behaviour("stream", "(stream ?u - camera ?o - image)", lasting=True)
WATCH = Behaviour("watch", "(watch ?u - detector ?i - image)", lasting=True)
READ = Behaviour("read", "(read ?u - sensor)")


def frames(camera: str) -> str:
    return f"{HOST}__{camera}__frames"


async def camera(house: House, name: str = "cam") -> None:
    unit = Unit("camera", "camera", outputs=(Output("frames", "image"),))
    await house.start(name, CAMERA, behaviours=(STREAM,), units=(unit,))
    house.behave(name, "stream", u=f"{HOST}__{name}__camera", o=frames(name))


async def watcher(house: House, name: str, source: str) -> Call:
    await house.start(name, WATCHER, behaviours=(WATCH,), units=(Unit("eye", "detector"),))
    return house.behave(name, "watch", u=f"{HOST}__{name}__eye", i=frames(source))


async def sees(house: House, name: str, count: int = 30) -> FactKnown:
    """Wait until a watcher has seen so many frames more."""
    seen = sum(1 for e in house.told(FactKnown) if e.predicate == "seen" and e.component == name)
    wanted = str((seen + 1) * 10 + count)
    return await house.until(FactKnown, lambda e: e.arguments[:2] == (name, wanted))


async def test_frames_flow_to_two_consumers(house: House) -> None:
    await camera(house)
    await watcher(house, "one", "cam")
    await watcher(house, "two", "cam")
    await sees(house, "one")
    await sees(house, "two")
    (status,) = house.workers.streams.listing()
    assert status.is_flowing
    assert status.readers == ("one", "two")


async def test_swapping_the_argument_swaps_the_feed(house: House) -> None:
    await camera(house, "left")
    await camera(house, "right")
    await watcher(house, "one", "left")
    assert (await sees(house, "one", 0)).arguments[2] == f"{HOST}__left__camera"
    await house.workers.stop("one")
    await watcher(house, "two", "right")
    assert (await sees(house, "two", 0)).arguments[2] == f"{HOST}__right__camera"


@pytest.mark.parametrize("number", [signal.SIGSTOP, signal.SIGKILL], ids=lambda n: n.name)
async def test_dead_consumer_costs_nobody_anything(house: House, number: signal.Signals) -> None:
    await camera(house)
    await watcher(house, "one", "cam")
    await watcher(house, "two", "cam")
    await sees(house, "two", 0)
    os.kill(house.workers.pids()["two"], number)
    await sees(house, "one", 100)
    assert "cam" in house.workers.pids()


async def test_stream_is_unwired_when_the_call_ends(house: House) -> None:
    await camera(house)
    watching = await watcher(house, "one", "cam")
    await sees(house, "one", 0)
    house.workers.halt_all()
    await house.until(StreamFlowing, lambda e: not e.flowing)
    assert await watching.ended() is RunState.HALTED
    (status,) = house.workers.streams.listing()
    assert not status.is_flowing
    assert status.readers == ()


async def test_stream_of_nobody_fails_the_call(house: House) -> None:
    await house.start("one", WATCHER, behaviours=(WATCH,), units=(Unit("eye", "detector"),))
    call = house.behave("one", "watch", u=f"{HOST}__one__eye", i=frames("gone"))
    assert await call.ended() is RunState.FAILED
    assert "STREAM_UNKNOWN" in call.reason


async def odometer(house: House, name: str) -> None:
    unit = Unit("wheels", "base", outputs=(Output("odometry", "pose", always=True),))
    await house.start(name, ODOMETER, units=(unit,))


async def panner(house: House) -> None:
    unit = Unit("reader", "sensor", inputs=(Input("odometry", "pose"),))
    await house.start("panner", PANNER, behaviours=(READ,), units=(unit,))


@pytest.mark.parametrize("is_first", [True, False], ids=["before", "after"])
async def test_optional_input_is_wired_to_what_flows(house: House, is_first: bool) -> None:
    if is_first:
        await odometer(house, "base")
    await panner(house)
    call = house.behave("panner", "read", u=f"{HOST}__panner__reader")
    if not is_first:
        await odometer(house, "base")
    assert await call.ended() is RunState.SUCCEEDED
    (status,) = house.workers.streams.listing()
    assert status.readers == ("panner.reader.odometry",)


async def test_optional_input_moves_on_when_its_stream_goes(house: House) -> None:
    await odometer(house, "a-base")
    await odometer(house, "b-base")
    await panner(house)
    await house.until(StreamFlowing, _from("a-base"))
    await house.until(StreamFlowing, _from("b-base"))
    assert _readers(house) == {f"{HOST}__a-base__odometry"}
    await house.workers.stop("a-base")
    assert _readers(house) == {f"{HOST}__b-base__odometry"}
    call = house.behave("panner", "read", u=f"{HOST}__panner__reader")
    assert await call.ended() is RunState.SUCCEEDED


async def test_restarted_reader_is_wired_again(house: House) -> None:
    await odometer(house, "base")
    await panner(house)
    os.kill(house.workers.pids()["panner"], signal.SIGKILL)
    await house.until(WorkerReady, lambda _: len(house.told(WorkerReady)) == 3)
    call = house.behave("panner", "read", u=f"{HOST}__panner__reader")
    assert await call.ended() is RunState.SUCCEEDED


async def test_claims_hold_what_was_said_before_anybody_listened(house: House) -> None:
    await odometer(house, "base")
    await house.until(StreamFlowing)
    stream = f"{HOST}__base__odometry"
    assert house.workers.claims("base") == (StreamFlowing("base", stream, True),)
    assert house.workers.claims("nobody") == ()


async def test_calls_are_established_only_by_themselves(house: House) -> None:
    await camera(house)
    established = await house.until(BehaviourEstablished)
    assert established.component == "cam"
    await asyncio.sleep(0)
    assert len(house.told(BehaviourEstablished)) == 1


def _from(component: str) -> Callable[[StreamFlowing], bool]:
    return lambda event: event.component == component


def _readers(house: House) -> set[str]:
    return {s.stream for s in house.workers.streams.listing() if s.readers}

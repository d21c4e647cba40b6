"""Frames between real workers: wired by what a call reads, dropped for slow consumers."""

from __future__ import annotations

import asyncio
import os
import signal
from collections.abc import Callable

import pytest
from tests.host.workers.streaming import CAMERA, STREAM, WATCH, WATCHER, sees
from tests.kit.workers import HOST, WorkersUnderTest

from nondum.host.core.events.behaviours import BehaviourEstablished
from nondum.host.core.events.facts import StreamFlowing
from nondum.host.workers.call import Call
from nondum.planning.execute.running import RunState
from nondum.sdk.description import Behaviour, Input, Output, Unit

pytestmark = pytest.mark.anyio

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
READ = Behaviour("read", "(read ?u - sensor)")


def frames(camera: str) -> str:
    return f"{HOST}__{camera}__frames"


async def camera(tested: WorkersUnderTest, name: str = "cam") -> None:
    unit = Unit("camera", "camera", outputs=(Output("frames", "image"),))
    await tested.start(name, CAMERA, behaviours=(STREAM,), units=(unit,))
    tested.behave(name, "stream", u=f"{HOST}__{name}__camera", o=frames(name))


async def watcher(tested: WorkersUnderTest, name: str, source: str) -> Call:
    await tested.start(name, WATCHER, behaviours=(WATCH,), units=(Unit("eye", "detector"),))
    return tested.behave(name, "watch", u=f"{HOST}__{name}__eye", i=frames(source))


async def test_frames_flow_to_two_consumers(tested: WorkersUnderTest) -> None:
    await camera(tested)
    await watcher(tested, "one", "cam")
    await watcher(tested, "two", "cam")
    await sees(tested, "one")
    await sees(tested, "two")
    (status,) = tested.workers.streams.listing()
    assert status.is_flowing
    assert status.readers == ("one", "two")


async def test_swapping_the_argument_swaps_the_feed(tested: WorkersUnderTest) -> None:
    await camera(tested, "left")
    await camera(tested, "right")
    await watcher(tested, "one", "left")
    assert (await sees(tested, "one", 0)).arguments[2] == f"{HOST}__left__camera"
    await tested.workers.stop("one")
    await watcher(tested, "two", "right")
    assert (await sees(tested, "two", 0)).arguments[2] == f"{HOST}__right__camera"


@pytest.mark.parametrize("number", [signal.SIGSTOP, signal.SIGKILL], ids=lambda n: n.name)
async def test_dead_consumer_holds_up_no_other_one(
    tested: WorkersUnderTest, number: signal.Signals
) -> None:
    await camera(tested)
    await watcher(tested, "one", "cam")
    await watcher(tested, "two", "cam")
    await sees(tested, "two", 0)
    os.kill(tested.workers.pids()["two"], number)
    await sees(tested, "one", 100)
    assert "cam" in tested.workers.pids()


async def test_stream_is_unwired_when_the_call_ends(tested: WorkersUnderTest) -> None:
    await camera(tested)
    watching = await watcher(tested, "one", "cam")
    await sees(tested, "one", 0)
    tested.workers.halt_all()
    await tested.until(StreamFlowing, lambda e: not e.flowing)
    assert await watching.ended() is RunState.HALTED
    (status,) = tested.workers.streams.listing()
    assert not status.is_flowing
    assert status.readers == ()


async def test_unknown_stream_fails_the_call(tested: WorkersUnderTest) -> None:
    await tested.start("one", WATCHER, behaviours=(WATCH,), units=(Unit("eye", "detector"),))
    call = tested.behave("one", "watch", u=f"{HOST}__one__eye", i=frames("gone"))
    assert await call.ended() is RunState.FAILED
    assert "STREAM_UNKNOWN" in call.reason


async def odometer(tested: WorkersUnderTest, name: str) -> None:
    unit = Unit("wheels", "base", outputs=(Output("odometry", "pose", always=True),))
    await tested.start(name, ODOMETER, units=(unit,))


async def panner(tested: WorkersUnderTest) -> None:
    unit = Unit("reader", "sensor", inputs=(Input("odometry", "pose"),))
    await tested.start("panner", PANNER, behaviours=(READ,), units=(unit,))


@pytest.mark.parametrize("is_first", [True, False], ids=["before", "after"])
async def test_optional_input_is_wired_to_what_flows(
    tested: WorkersUnderTest, is_first: bool
) -> None:
    if is_first:
        await odometer(tested, "base")
    await panner(tested)
    call = tested.behave("panner", "read", u=f"{HOST}__panner__reader")
    if not is_first:
        await odometer(tested, "base")
    assert await call.ended() is RunState.SUCCEEDED
    (status,) = tested.workers.streams.listing()
    assert status.readers == ("panner.reader.odometry",)


async def test_optional_input_moves_on_when_its_stream_goes(tested: WorkersUnderTest) -> None:
    await odometer(tested, "a-base")
    await odometer(tested, "b-base")
    await panner(tested)
    await tested.until(StreamFlowing, _from("a-base"))
    await tested.until(StreamFlowing, _from("b-base"))
    assert _readers(tested) == {f"{HOST}__a-base__odometry"}
    await tested.workers.stop("a-base")
    assert _readers(tested) == {f"{HOST}__b-base__odometry"}
    call = tested.behave("panner", "read", u=f"{HOST}__panner__reader")
    assert await call.ended() is RunState.SUCCEEDED


async def test_restarted_reader_is_wired_again(tested: WorkersUnderTest) -> None:
    await odometer(tested, "base")
    await panner(tested)
    os.kill(tested.workers.pids()["panner"], signal.SIGKILL)
    await tested.until_ready(3)
    call = tested.behave("panner", "read", u=f"{HOST}__panner__reader")
    assert await call.ended() is RunState.SUCCEEDED


async def test_claims_hold_what_was_said_before_anybody_listened(tested: WorkersUnderTest) -> None:
    await odometer(tested, "base")
    await tested.until(StreamFlowing)
    stream = f"{HOST}__base__odometry"
    assert tested.workers.claims("base") == (StreamFlowing("base", stream, True),)
    assert tested.workers.claims("stranger") == ()


async def test_calls_are_established_only_by_themselves(tested: WorkersUnderTest) -> None:
    await camera(tested)
    established = await tested.until(BehaviourEstablished)
    assert established.component == "cam"
    await asyncio.sleep(0)
    assert len(tested.told(BehaviourEstablished)) == 1


def _from(component: str) -> Callable[[StreamFlowing], bool]:
    return lambda event: event.component == component


def _readers(tested: WorkersUnderTest) -> set[str]:
    return {s.stream for s in tested.workers.streams.listing() if s.readers}

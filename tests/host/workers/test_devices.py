"""Devices are granted to workers, withdrawn from them, and survive their restarts."""

from __future__ import annotations

import asyncio
import errno
import os
import signal
import threading

import pytest
from tests.kit.workers import HOST, WorkersUnderTest

from nondum.host.core.events.facts import FactKnown
from nondum.planning.execute.running import RunState
from nondum.sdk.description import Behaviour, Unit
from nondum.sdk.messages import Bearing, Header, value_to_wire
from nondum.wheelhouse.format.confinement import Level

pytestmark = pytest.mark.anyio

PLUGIN = """
from nondum.sdk import Unit, behaviour, hookimpl

@hookimpl
def units():
    return (Unit("port", "sensor"),)

@behaviour("look", action="(look ?u - sensor)")
async def look(ctx, u):
    device = ctx.device("line")
    ctx.know("node", device.node if device else "none")

@behaviour("convert", action="(convert ?u - sensor ?h - host)")
async def convert(ctx, u, h):
    seen = ctx.value("bearing-known", h)
    turned = ctx.transform(seen, to=h)
    ctx.know("left", f"{turned.direction[1]:.2f}", ctx.settings["name"])
"""
LOOK = Behaviour("look", "(look ?u - sensor)")
CONVERT = Behaviour("convert", "(convert ?u - sensor ?h - host)")
UNIT = f"{HOST}__guest__port"


async def guest(tested: WorkersUnderTest) -> None:
    await tested.start(
        "guest",
        PLUGIN,
        behaviours=(CONVERT, LOOK),
        units=(Unit("port", "sensor"),),
        settings={"name": "ada"},
    )


async def node(tested: WorkersUnderTest) -> str:
    """What the plugin has been granted now."""
    seen = len(tested.told(FactKnown))
    assert await tested.behave("guest", "look", u=UNIT).ended() is RunState.SUCCEEDED
    return tested.told(FactKnown)[seen].arguments[0]


def seen(tested: WorkersUnderTest) -> str:
    """Where a worker finds the device for its need `line`."""
    return "/dev/nondum/line" if tested.workers.launcher.level == Level.SANDBOXED else "/dev/zero"


async def test_device_is_granted_and_withdrawn(tested: WorkersUnderTest) -> None:
    await guest(tested)
    assert await node(tested) == "none"
    await tested.workers.attach("guest", "line", "/dev/zero", {"ID_BUS": "usb"})
    assert await node(tested) == seen(tested)
    await tested.workers.detach("guest", "line")
    assert await node(tested) == "none"


async def test_behaviour_begins_once_what_was_granted_before_is_there(
    tested: WorkersUnderTest,
) -> None:
    await guest(tested)
    granting = asyncio.create_task(tested.workers.attach("guest", "line", "/dev/zero", {}))
    await asyncio.sleep(0)  # it has begun
    assert await node(tested) == seen(tested)
    await granting


async def test_behaviour_that_waits_for_a_device_can_be_halted(tested: WorkersUnderTest) -> None:
    await guest(tested)
    free = threading.Event()
    loop = asyncio.get_running_loop()
    busy = [loop.run_in_executor(None, free.wait) for _ in range(64)]  # a device is let in by such
    granting = asyncio.create_task(tested.workers.attach("guest", "line", "/dev/zero", {}))
    await asyncio.sleep(0)
    call = tested.behave("guest", "look", u=UNIT)
    await asyncio.sleep(0)
    call.halt()
    assert await call.ended() is RunState.HALTED
    assert not granting.done()
    free.set()
    await asyncio.gather(granting, *busy)
    assert await node(tested) == seen(tested)


async def test_device_that_is_being_pulled_is_not_told_as_another(tested: WorkersUnderTest) -> None:
    await guest(tested)
    await tested.workers.attach("guest", "line", "/dev/zero", {})
    await tested.workers.attach("guest", "line", "/dev/pulled", {})
    assert await node(tested) == seen(tested)
    await tested.workers.detach("guest", "line")
    assert await node(tested) == "none"


async def test_device_granted_before_the_start_is_there(tested: WorkersUnderTest) -> None:
    await tested.workers.attach("guest", "line", "/dev/zero", {})
    await guest(tested)
    assert await node(tested) == seen(tested)


async def test_device_outlives_a_crash(tested: WorkersUnderTest) -> None:
    await guest(tested)
    await tested.workers.attach("guest", "line", "/dev/zero", {})
    os.kill(tested.workers.pids()["guest"], signal.SIGKILL)
    await tested.until_ready(2)
    assert await node(tested) == seen(tested)


async def test_values_mounts_and_settings_reach_behaviours(tested: WorkersUnderTest) -> None:
    await guest(tested)
    half = 0.5**0.5  # a quarter turn to the left
    tested.workers.remount({UNIT: [HOST, [0.0, 0.0, 0.3], [0.0, 0.0, half, half]]})
    ahead = value_to_wire(Bearing(Header(frame_id=UNIT), (1.0, 0.0, 0.0), 0.1))
    call = tested.workers.behave(
        "guest", "convert", {"u": UNIT, "h": HOST}, [("bearing-known", (HOST,), ahead)]
    )
    assert await call.ended() is RunState.SUCCEEDED, call.reason
    assert tested.told(FactKnown)[0].arguments == ("1.00", "ada")


async def test_value_can_be_withdrawn(tested: WorkersUnderTest) -> None:
    await guest(tested)
    tested.workers.tell_values("guest", [("bearing-known", (HOST,), None)])
    call = tested.behave("guest", "convert", u=UNIT, h=HOST)
    assert await call.ended() is RunState.FAILED
    assert "VALUE_UNKNOWN" in call.reason


async def test_strangers_are_told_nothing(tested: WorkersUnderTest) -> None:
    tested.workers.tell_values("stranger", [("p", (), None)])
    await tested.workers.detach("stranger", "line")
    await tested.workers.stop("stranger")


GROUP = """
from nondum.sdk import Unit, behaviour, hookimpl

@hookimpl
def units():
    return (Unit("port", "sensor"),)

@behaviour("look", action="(look ?u - sensor)")
async def look(ctx, u):
    device = ctx.device("line")
    for node in device.nodes:
        with open(node.node, "rb+", buffering=0) as file:
            file.write(b"x")
        ctx.know("node", node.node, node.subsystem)
"""


async def test_device_of_several_nodes_is_granted_as_a_group(tested: WorkersUnderTest) -> None:
    others = (("/dev/full", {"SUBSYSTEM": "b"}),)
    await tested.workers.attach("guest", "line", "/dev/zero", {"SUBSYSTEM": "a"}, others)
    await tested.start("guest", GROUP, behaviours=(LOOK,), units=(Unit("port", "sensor"),))
    in_box = tested.workers.launcher.level == Level.SANDBOXED
    zero = "/dev/nondum/line" if in_box else "/dev/zero"
    null = "/dev/nondum/line.null" if in_box else "/dev/null"
    call = tested.behave("guest", "look", u=UNIT)
    assert await call.ended() is RunState.FAILED  # a full disk tells that it was the one written to
    assert os.strerror(errno.ENOSPC) in call.reason
    assert [fact.arguments for fact in tested.told(FactKnown)] == [(zero, "a")]
    others = (("/dev/null", {"SUBSYSTEM": "c"}),)
    await tested.workers.attach("guest", "line", "/dev/zero", {"SUBSYSTEM": "a"}, others)
    assert await tested.behave("guest", "look", u=UNIT).ended() is RunState.SUCCEEDED
    told = [fact.arguments for fact in tested.told(FactKnown)]
    assert told[1:] == [(zero, "a"), (null, "c")]


NAMED = """
import os
from nondum.sdk import Unit, behaviour, hookimpl

@hookimpl
def units():
    return (Unit("port", "sensor"),)

@behaviour("look", action="(look ?u - sensor)")
async def look(ctx, u):
    ctx.know("link", os.path.realpath("/dev/kmsg") if os.path.islink("/dev/kmsg") else "none")
"""


async def test_node_is_found_by_its_own_name_in_a_sandbox(tested: WorkersUnderTest) -> None:
    if tested.workers.launcher.level != Level.SANDBOXED:
        pytest.skip("only a sandbox has a separate /dev")
    await tested.start("guest", NAMED, behaviours=(LOOK,), units=(Unit("port", "sensor"),))
    await tested.workers.attach("guest", "line", "/dev/kmsg", {})
    assert await tested.behave("guest", "look", u=UNIT).ended() is RunState.SUCCEEDED
    await tested.workers.detach("guest", "line")
    assert await tested.behave("guest", "look", u=UNIT).ended() is RunState.SUCCEEDED
    told = [fact.arguments[0] for fact in tested.told(FactKnown)]
    assert told == ["/dev/nondum/line", "none"]

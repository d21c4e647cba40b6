"""Devices are granted to workers, withdrawn from them, and survive their restarts."""

from __future__ import annotations

import os
import signal

import pytest
from tests.kit.house import HOST, House

from nondum.host.confinement import Level
from nondum.host.events import FactKnown, WorkerReady
from nondum.host.workers import supervision
from nondum.planning.running import RunState
from nondum.sdk.description import Behaviour, Unit
from nondum.sdk.messages import Bearing, Header, value_to_wire

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


async def guest(house: House) -> None:
    await house.start(
        "guest",
        PLUGIN,
        behaviours=(CONVERT, LOOK),
        units=(Unit("port", "sensor"),),
        settings={"name": "ada"},
    )


async def node(house: House) -> str:
    """What the plugin has been granted now."""
    seen = len(house.told(FactKnown))
    assert await house.behave("guest", "look", u=UNIT).ended() is RunState.SUCCEEDED
    return house.told(FactKnown)[seen].arguments[0]


def seen(house: House) -> str:
    """Where a worker finds the device for its need `line`."""
    return "/dev/nondum/line" if house.workers.launcher.level == Level.BOX else "/dev/zero"


async def test_device_is_granted_and_withdrawn(house: House) -> None:
    await guest(house)
    assert await node(house) == "none"
    await house.workers.attach("guest", "line", "/dev/zero", {"ID_BUS": "usb"})
    assert await node(house) == seen(house)
    await house.workers.detach("guest", "line")
    assert await node(house) == "none"


async def test_device_that_is_being_pulled_is_not_told_as_another(house: House) -> None:
    await guest(house)
    await house.workers.attach("guest", "line", "/dev/zero", {})
    await house.workers.attach("guest", "line", "/dev/pulled", {})
    assert await node(house) == seen(house)
    await house.workers.detach("guest", "line")
    assert await node(house) == "none"


async def test_device_granted_before_the_start_is_there(house: House) -> None:
    await house.workers.attach("guest", "line", "/dev/zero", {})
    await guest(house)
    assert await node(house) == seen(house)


async def test_device_outlives_a_crash(house: House, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(supervision, "BACKOFF_S", 0.02)
    await guest(house)
    await house.workers.attach("guest", "line", "/dev/zero", {})
    os.kill(house.workers.pids()["guest"], signal.SIGKILL)
    await house.until(WorkerReady, lambda _: len(house.told(WorkerReady)) == 2)
    assert await node(house) == seen(house)


async def test_values_mounts_and_settings_reach_behaviours(house: House) -> None:
    await guest(house)
    half = 0.5**0.5  # a quarter turn to the left
    house.workers.remount({UNIT: [HOST, [0.0, 0.0, 0.3], [0.0, 0.0, half, half]]})
    ahead = value_to_wire(Bearing(Header(frame_id=UNIT), (1.0, 0.0, 0.0), 0.1))
    call = house.workers.behave(
        "guest", "convert", {"u": UNIT, "h": HOST}, [("bearing-known", (HOST,), ahead)]
    )
    assert await call.ended() is RunState.SUCCEEDED, call.reason
    assert house.told(FactKnown)[0].arguments == ("1.00", "ada")


async def test_value_can_be_withdrawn(house: House) -> None:
    await guest(house)
    house.workers.tell_values("guest", [("bearing-known", (HOST,), None)])
    call = house.behave("guest", "convert", u=UNIT, h=HOST)
    assert await call.ended() is RunState.FAILED
    assert "VALUE_UNKNOWN" in call.reason


async def test_strangers_are_told_nothing(house: House) -> None:
    house.workers.tell_values("nobody", [("p", (), None)])
    await house.workers.detach("nobody", "line")
    await house.workers.stop("nobody")


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


async def test_device_of_several_nodes_is_granted_as_a_group(house: House) -> None:
    others = (("/dev/full", {"SUBSYSTEM": "b"}),)
    await house.workers.attach("guest", "line", "/dev/zero", {"SUBSYSTEM": "a"}, others)
    await house.start("guest", GROUP, behaviours=(LOOK,), units=(Unit("port", "sensor"),))
    in_box = house.workers.launcher.level == Level.BOX
    zero = "/dev/nondum/line" if in_box else "/dev/zero"
    null = "/dev/nondum/line.null" if in_box else "/dev/null"
    call = house.behave("guest", "look", u=UNIT)
    assert await call.ended() is RunState.FAILED  # a full disk tells that it was the one written to
    assert "No space left" in call.reason
    assert [fact.arguments for fact in house.told(FactKnown)] == [(zero, "a")]
    others = (("/dev/null", {"SUBSYSTEM": "c"}),)
    await house.workers.attach("guest", "line", "/dev/zero", {"SUBSYSTEM": "a"}, others)
    assert await house.behave("guest", "look", u=UNIT).ended() is RunState.SUCCEEDED
    told = [fact.arguments for fact in house.told(FactKnown)]
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


async def test_node_is_found_by_its_own_name_in_a_room(house: House) -> None:
    if house.workers.launcher.level != Level.BOX:
        pytest.skip("only a room has a /dev of its own")
    await house.start("guest", NAMED, behaviours=(LOOK,), units=(Unit("port", "sensor"),))
    await house.workers.attach("guest", "line", "/dev/kmsg", {})
    assert await house.behave("guest", "look", u=UNIT).ended() is RunState.SUCCEEDED
    await house.workers.detach("guest", "line")
    assert await house.behave("guest", "look", u=UNIT).ended() is RunState.SUCCEEDED
    told = [fact.arguments[0] for fact in house.told(FactKnown)]
    assert told == ["/dev/nondum/line", "none"]

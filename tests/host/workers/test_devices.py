"""Devices are granted to workers, withdrawn from them, and survive their restarts."""

from __future__ import annotations

import os
import signal

import pytest
from tests.host.workers.house import HOST, House

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

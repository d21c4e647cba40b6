"""Two releases of a component run side by side; one of them counts, and they never act at once."""

from __future__ import annotations

import asyncio
from dataclasses import replace

import pytest
from tests.kit.house import HOST, House, is_alive

from nondum.host.events import FactKnown, TrialFailed, WorkerExited, WorkerReady
from nondum.host.workers import WorkerSpec
from nondum.planning.running import RunState
from nondum.sdk.description import Behaviour, Unit
from nondum.sdk.errors import WorkerFailed

pytestmark = pytest.mark.anyio

PLUGIN = """
from nondum.sdk import Unit, behaviour, hookimpl

@hookimpl
def units():
    return (Unit("port", "sensor"),)

@hookimpl
def start(ctx):
    ctx.know("release", ctx.settings["release"])

@hookimpl
def stop(ctx):
    import time
    time.sleep(0.3)

@behaviour("look", action="(look ?u - sensor)")
async def look(ctx, u):
    device = ctx.device("line")
    ctx.know("looked", ctx.settings["release"], device.node if device else "none")

@behaviour("fall", action="(fall ?u - sensor)")
async def fall(ctx, u):
    import os
    os._exit(3)
"""
BEHAVIOURS = (Behaviour("fall", "(fall ?u - sensor)"), Behaviour("look", "(look ?u - sensor)"))
UNIT = f"{HOST}__guest__port"
OLD, NEW = "0" * 16, "1" * 16

FALLS = (
    PLUGIN
    + """
import os, threading
threading.Timer(0.5, os._exit, (3,)).start()
"""
)
"""Ends soon after it was imported."""


def spec(house: House, release: str, source: str = PLUGIN) -> WorkerSpec:
    """A release of the component `guest`."""
    made = house.spec(
        release,
        source,
        behaviours=BEHAVIOURS,
        units=(Unit("port", "sensor"),),
        settings={"release": release},
    )
    payload = {"old": OLD, "new": NEW}[release]
    return replace(made, component="guest", payload=payload)


async def side_by_side(house: House) -> tuple[int, int]:
    """Both run, the old one in force; their processes."""
    await house.workers.start(spec(house, "old"))
    await house.workers.start(spec(house, "new"))
    (old,), (new,) = house.workers.pids_of(OLD), house.workers.pids_of(NEW)
    assert house.workers.pids() == {"guest": old}
    return old, new


def facts(house: House) -> list[tuple[str, ...]]:
    return [event.arguments for event in house.told(FactKnown)]


async def test_worker_that_is_tried_is_not_heard_nor_asked(house: House) -> None:
    await side_by_side(house)
    assert await house.behave("guest", "look", u=UNIT).ended() is RunState.SUCCEEDED
    assert facts(house) == [("old",), ("old", "none")]
    assert [event.payload for event in house.told(WorkerReady)] == [OLD]


async def test_it_counts_once_it_has_taken_over(house: House) -> None:
    old, new = await side_by_side(house)
    house.workers.take_over({"guest": NEW})
    assert house.workers.pids() == {"guest": new}
    assert [c.arguments for c in house.workers.claims("guest") if isinstance(c, FactKnown)] == [
        ("new",)
    ]
    call = house.behave("guest", "look", u=UNIT)
    await asyncio.sleep(0)
    assert is_alive(old)
    assert ("new", "none") not in facts(house), "two releases never act at once"
    await house.workers.stop("guest", 1.0, OLD)
    assert await call.ended() is RunState.SUCCEEDED
    assert facts(house)[-1] == ("new", "none")
    assert not is_alive(old)
    assert house.workers.pids() == {"guest": new}
    assert not house.told(WorkerExited)


async def test_device_is_handed_over_once_the_old_one_has_ended(house: House) -> None:
    await house.workers.attach("guest", "line", "/dev/zero", {})
    old, _ = await side_by_side(house)
    house.workers.take_over({"guest": NEW})
    attaching = asyncio.create_task(house.workers.attach("guest", "line", "/dev/zero", {}))
    stopping = asyncio.create_task(house.workers.stop("guest", 1.0, OLD))
    await attaching
    assert not is_alive(old)
    await stopping
    assert await house.behave("guest", "look", u=UNIT).ended() is RunState.SUCCEEDED
    assert facts(house)[-1][0] == "new"
    assert facts(house)[-1][1] != "none"


async def test_device_of_another_component_is_not_waited_for(house: House) -> None:
    await house.workers.attach("guest", "line", "/dev/zero", {})
    await side_by_side(house)
    house.workers.take_over({"guest": NEW})
    await house.workers.attach("guest", "line", "/dev/null", {})
    await house.workers.stop("guest", 1.0, OLD)


async def test_worker_that_is_tried_is_given_up_when_it_ends(house: House) -> None:
    await house.workers.start(spec(house, "old"))
    await house.workers.start(spec(house, "new", FALLS))
    with pytest.raises(WorkerFailed, match="status 3"):
        await house.workers.watched("guest", NEW)
    failed = await house.until(TrialFailed)
    assert (failed.payload, failed.component) == (NEW, "guest")
    assert not house.told(WorkerExited)
    await house.workers.stop("guest", 1.0, NEW)
    assert len(house.workers.pids()) == 1


async def test_stopping_one_leaves_the_other(house: House) -> None:
    old, new = await side_by_side(house)
    await house.workers.stop("guest", 1.0, NEW)
    assert is_alive(old)
    assert not is_alive(new)
    await house.workers.ended(NEW)
    assert await house.behave("guest", "look", u=UNIT).ended() is RunState.SUCCEEDED


async def test_one_in_force_may_be_gone_by_the_time_it_is_replaced(house: House) -> None:
    old, new = await side_by_side(house)
    await house.workers.stop("guest", 1.0, OLD)
    assert not is_alive(old)
    assert not house.workers.pids()
    house.workers.take_over({"guest": NEW})
    assert house.workers.pids() == {"guest": new}

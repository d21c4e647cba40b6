"""Two releases of a component run side by side; one of them counts, and they never act at once."""

from __future__ import annotations

import asyncio
from dataclasses import replace

import pytest
from tests.kit.processes import is_alive
from tests.kit.workers import HOST, WorkersUnderTest

from nondum.host.core.events.facts import FactKnown
from nondum.host.core.events.releases import TrialFailed
from nondum.host.core.events.workers import WorkerExited, WorkerReady
from nondum.host.workers.spec import WorkerSpec
from nondum.planning.execute.running import RunState
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


def spec(tested: WorkersUnderTest, release: str, source: str = PLUGIN) -> WorkerSpec:
    """A release of the component `guest`."""
    made = tested.spec(
        release,
        source,
        behaviours=BEHAVIOURS,
        units=(Unit("port", "sensor"),),
        settings={"release": release},
    )
    payload = {"old": OLD, "new": NEW}[release]
    return replace(made, component="guest", payload=payload)


async def side_by_side(tested: WorkersUnderTest) -> tuple[int, int]:
    """Both run, the old one is active; their processes."""
    await tested.workers.start(spec(tested, "old"))
    await tested.workers.start(spec(tested, "new"))
    (old,), (new,) = tested.workers.pids_of(OLD), tested.workers.pids_of(NEW)
    assert tested.workers.pids() == {"guest": old}
    return old, new


def facts(tested: WorkersUnderTest) -> list[tuple[str, ...]]:
    return [event.arguments for event in tested.told(FactKnown)]


async def test_worker_on_trial_emits_nothing_and_is_not_asked(tested: WorkersUnderTest) -> None:
    await side_by_side(tested)
    assert await tested.behave("guest", "look", u=UNIT).ended() is RunState.SUCCEEDED
    assert facts(tested) == [("old",), ("old", "none")]
    assert [event.payload for event in tested.told(WorkerReady)] == [OLD]


async def test_it_counts_once_it_has_taken_over(tested: WorkersUnderTest) -> None:
    old, new = await side_by_side(tested)
    tested.workers.take_over({"guest": NEW})
    assert tested.workers.pids() == {"guest": new}
    assert [c.arguments for c in tested.workers.claims("guest") if isinstance(c, FactKnown)] == [
        ("new",)
    ]
    call = tested.behave("guest", "look", u=UNIT)
    await asyncio.sleep(0)
    assert is_alive(old)
    assert ("new", "none") not in facts(tested), "two releases never act at once"
    await tested.workers.stop("guest", 1.0, OLD)
    assert await call.ended() is RunState.SUCCEEDED
    assert facts(tested)[-1] == ("new", "none")
    assert not is_alive(old)
    assert tested.workers.pids() == {"guest": new}
    assert not tested.told(WorkerExited)


async def test_device_is_handed_over_once_the_old_one_has_ended(tested: WorkersUnderTest) -> None:
    await tested.workers.attach("guest", "line", "/dev/zero", {})
    old, _ = await side_by_side(tested)
    tested.workers.take_over({"guest": NEW})
    attaching = asyncio.create_task(tested.workers.attach("guest", "line", "/dev/zero", {}))
    stopping = asyncio.create_task(tested.workers.stop("guest", 1.0, OLD))
    await attaching
    assert not is_alive(old)
    await stopping
    assert await tested.behave("guest", "look", u=UNIT).ended() is RunState.SUCCEEDED
    assert facts(tested)[-1][0] == "new"
    assert facts(tested)[-1][1] != "none"


async def test_device_of_another_component_is_not_waited_for(tested: WorkersUnderTest) -> None:
    await tested.workers.attach("guest", "line", "/dev/zero", {})
    await side_by_side(tested)
    tested.workers.take_over({"guest": NEW})
    await tested.workers.attach("guest", "line", "/dev/null", {})
    await tested.workers.stop("guest", 1.0, OLD)


async def test_worker_that_is_tried_is_given_up_when_it_ends(tested: WorkersUnderTest) -> None:
    await tested.workers.start(spec(tested, "old"))
    await tested.workers.start(spec(tested, "new", FALLS))
    with pytest.raises(WorkerFailed, match="status 3"):
        await tested.workers.watched("guest", NEW)
    failed = await tested.until(TrialFailed)
    assert (failed.payload, failed.component) == (NEW, "guest")
    assert not tested.told(WorkerExited)
    await tested.workers.stop("guest", 1.0, NEW)
    assert len(tested.workers.pids()) == 1


async def test_stopping_one_leaves_the_other(tested: WorkersUnderTest) -> None:
    old, new = await side_by_side(tested)
    await tested.workers.stop("guest", 1.0, NEW)
    assert is_alive(old)
    assert not is_alive(new)
    await tested.workers.ended(NEW)
    assert await tested.behave("guest", "look", u=UNIT).ended() is RunState.SUCCEEDED


async def test_one_in_force_may_be_gone_by_the_time_it_is_replaced(
    tested: WorkersUnderTest,
) -> None:
    old, new = await side_by_side(tested)
    await tested.workers.stop("guest", 1.0, OLD)
    assert not is_alive(old)
    assert not tested.workers.pids()
    tested.workers.take_over({"guest": NEW})
    assert tested.workers.pids() == {"guest": new}

"""Workers from start to stop: behaviours run, establish, fail, halt; facts and lines arrive."""

from __future__ import annotations

import asyncio

import pytest
from tests.kit.house import HOST, House, is_alive

from nondum.host.events import (
    BehaviourEnded,
    BehaviourEstablished,
    BehaviourProgressed,
    FactForgotten,
    FactKnown,
    WorkerLogged,
    WorkerReady,
)
from nondum.planning.running import RunState
from nondum.sdk.description import Behaviour, Unit
from nondum.sdk.errors import WorkerFailed

pytestmark = pytest.mark.anyio

LINGERING = """
import asyncio
from nondum.sdk import hookimpl

@hookimpl
async def stop(ctx):
    print("leaving")
    await asyncio.Event().wait()
"""
GREETER = '''
"""Greets."""
import asyncio
from nondum.sdk import BehaviourFailed, Unit, behaviour, hookimpl

@hookimpl
def units():
    return (Unit("mouth", "speaker"),)

@hookimpl
async def start(ctx):
    print("ready in", ctx.host)

@behaviour("greet", action="(greet ?u - speaker ?t - target)")
async def greet(ctx, u, t):
    ctx.progress(0.5, "half way")
    ctx.know("greeted", t)
    ctx.log.info("greeting %s by %s", t, u)

@behaviour("refuse", action="(refuse ?u - speaker)")
async def refuse(ctx, u):
    raise BehaviourFailed("too shy")

@behaviour("hum", action="(hum ?u - speaker)", lasting=True)
async def hum(ctx, u):
    ctx.know("humming", u)
    await ctx.established()
    try:
        await asyncio.Event().wait()
    finally:
        ctx.forget("humming", u)
'''
BEHAVIOURS = (
    Behaviour("greet", "(greet ?u - speaker ?t - target)"),
    Behaviour("hum", "(hum ?u - speaker)", lasting=True),
    Behaviour("refuse", "(refuse ?u - speaker)"),
)


async def greeter(house: House) -> None:
    await house.start(
        "greeter",
        GREETER,
        behaviours=BEHAVIOURS,
        units=(Unit("mouth", "speaker"),),
        summary="Greets.",
    )


async def test_worker_describes_itself_and_starts(house: House) -> None:
    await greeter(house)
    ready = await house.until(WorkerReady)
    assert ready.description.summary == "Greets."
    await house.until(WorkerLogged, lambda line: line.message == f"ready in {HOST}")


async def test_finishing_behaviour_succeeds(house: House) -> None:
    await greeter(house)
    call = house.behave("greeter", "greet", u=f"{HOST}__greeter__mouth", t="ada")
    assert await call.ended() is RunState.SUCCEEDED
    known = await house.until(FactKnown)
    assert (known.component, known.predicate, known.arguments) == ("greeter", "greeted", ("ada",))
    progress = await house.until(BehaviourProgressed)
    assert (progress.call_id, progress.fraction, progress.text) == (call.id, 0.5, "half way")
    said = f"greeting ada by {HOST}__greeter__mouth"
    logged = await house.until(WorkerLogged, lambda line: line.message == said)
    assert logged.level == "info"
    assert said in house.lines("greeter")


async def test_failing_behaviour_says_why(house: House) -> None:
    await greeter(house)
    call = house.behave("greeter", "refuse", u=f"{HOST}__greeter__mouth")
    assert await call.ended() is RunState.FAILED
    assert "too shy" in call.reason


async def test_lasting_behaviour_is_established_until_halted(house: House) -> None:
    await greeter(house)
    call = house.behave("greeter", "hum", u=f"{HOST}__greeter__mouth")
    await house.until(BehaviourEstablished)
    assert call.state is RunState.ESTABLISHED
    call.halt()
    assert await call.ended() is RunState.HALTED
    await house.until(FactForgotten)
    assert house.ends() == [("hum", "HALTED")]


async def test_stopping_that_is_cancelled_leaves_no_process(house: House) -> None:
    """As when a daemon ends while a payload is withdrawn."""
    await house.start("guest", LINGERING)
    pid = house.workers.pids()["guest"]
    stopping = asyncio.create_task(house.workers.stop("guest"))
    await house.until(WorkerLogged, lambda line: line.message == "leaving")
    stopping.cancel()
    await house.workers.close()
    assert not is_alive(pid)
    with pytest.raises(asyncio.CancelledError):
        await stopping


async def test_stopping_halts_and_ends_the_process(house: House) -> None:
    await greeter(house)
    (pid,) = house.workers.pids().values()
    call = house.behave("greeter", "hum", u=f"{HOST}__greeter__mouth")
    await house.until(BehaviourEstablished)
    await house.workers.stop("greeter")
    assert await call.ended() is RunState.HALTED
    assert not is_alive(pid)
    with pytest.raises(WorkerFailed, match="NOT_RUNNING"):
        house.behave("greeter", "hum", u="")


async def test_call_halted_at_once_never_begins(house: House) -> None:
    await greeter(house)
    call = house.behave("greeter", "greet", u=f"{HOST}__greeter__mouth", t="ada")
    call.halt()
    assert await call.ended() is RunState.HALTED
    assert not house.told(FactKnown)


async def test_ends_are_told_once_and_after_the_start(house: House) -> None:
    await greeter(house)
    call = house.behave("greeter", "refuse", u=f"{HOST}__greeter__mouth")
    await call.ended()
    await house.workers.stop("greeter")
    assert len(house.told(BehaviourEnded)) == 1

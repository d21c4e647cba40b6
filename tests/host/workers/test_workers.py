"""Workers from start to stop: behaviours run, establish, fail, halt; facts and lines arrive."""

from __future__ import annotations

import asyncio

import pytest
from tests.kit.processes import is_alive
from tests.kit.workers import HOST, WorkersUnderTest

from nondum.host.core.events.behaviours import (
    BehaviourEnded,
    BehaviourEstablished,
    BehaviourProgressed,
)
from nondum.host.core.events.facts import FactForgotten, FactKnown
from nondum.host.core.events.workers import WorkerLogged, WorkerReady
from nondum.planning.execute.running import RunState
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


async def greeter(tested: WorkersUnderTest) -> None:
    await tested.start(
        "greeter",
        GREETER,
        behaviours=BEHAVIOURS,
        units=(Unit("mouth", "speaker"),),
        summary="Greets.",
    )


async def test_worker_describes_itself_and_starts(tested: WorkersUnderTest) -> None:
    await greeter(tested)
    ready = await tested.until(WorkerReady)
    assert ready.description.summary == "Greets."
    await tested.until(WorkerLogged, lambda line: line.message == f"ready in {HOST}")


async def test_finishing_behaviour_succeeds(tested: WorkersUnderTest) -> None:
    await greeter(tested)
    call = tested.behave("greeter", "greet", u=f"{HOST}__greeter__mouth", t="ada")
    assert await call.ended() is RunState.SUCCEEDED
    known = await tested.until(FactKnown)
    assert (known.component, known.predicate, known.arguments) == ("greeter", "greeted", ("ada",))
    progress = await tested.until(BehaviourProgressed)
    assert (progress.call_id, progress.fraction, progress.text) == (call.id, 0.5, "half way")
    said = f"greeting ada by {HOST}__greeter__mouth"
    logged = await tested.until(WorkerLogged, lambda line: line.message == said)
    assert logged.level == "info"
    assert said in tested.lines("greeter")


async def test_failing_behaviour_says_why(tested: WorkersUnderTest) -> None:
    await greeter(tested)
    call = tested.behave("greeter", "refuse", u=f"{HOST}__greeter__mouth")
    assert await call.ended() is RunState.FAILED
    assert "too shy" in call.reason


async def test_lasting_behaviour_is_established_until_halted(tested: WorkersUnderTest) -> None:
    await greeter(tested)
    call = tested.behave("greeter", "hum", u=f"{HOST}__greeter__mouth")
    await tested.until(BehaviourEstablished)
    assert call.state is RunState.ESTABLISHED
    call.halt()
    assert await call.ended() is RunState.HALTED
    await tested.until(FactForgotten)
    assert tested.ends() == [("hum", "HALTED")]


async def test_stopping_that_is_cancelled_leaves_no_process(tested: WorkersUnderTest) -> None:
    """As when a daemon ends while a payload is withdrawn."""
    await tested.start("guest", LINGERING)
    pid = tested.workers.pids()["guest"]
    stopping = asyncio.create_task(tested.workers.stop("guest"))
    await tested.until(WorkerLogged, lambda line: line.message == "leaving")
    stopping.cancel()
    await tested.workers.close()
    assert not is_alive(pid)
    with pytest.raises(asyncio.CancelledError):
        await stopping


async def test_stopping_halts_and_ends_the_process(tested: WorkersUnderTest) -> None:
    await greeter(tested)
    (pid,) = tested.workers.pids().values()
    call = tested.behave("greeter", "hum", u=f"{HOST}__greeter__mouth")
    await tested.until(BehaviourEstablished)
    await tested.workers.stop("greeter")
    assert await call.ended() is RunState.HALTED
    assert not is_alive(pid)
    with pytest.raises(WorkerFailed, match="NOT_RUNNING"):
        tested.behave("greeter", "hum", u="")


async def test_call_halted_at_once_never_begins(tested: WorkersUnderTest) -> None:
    await greeter(tested)
    call = tested.behave("greeter", "greet", u=f"{HOST}__greeter__mouth", t="ada")
    call.halt()
    assert await call.ended() is RunState.HALTED
    assert not tested.told(FactKnown)


async def test_ends_are_told_once_and_after_the_start(tested: WorkersUnderTest) -> None:
    await greeter(tested)
    call = tested.behave("greeter", "refuse", u=f"{HOST}__greeter__mouth")
    await call.ended()
    await tested.workers.stop("greeter")
    assert len(tested.told(BehaviourEnded)) == 1

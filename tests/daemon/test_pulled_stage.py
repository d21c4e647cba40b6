"""The demonstration's stage of a pulled drive, on small plugins: an honest robot passes it, and one
that does not halt, or does not stand, fails it."""

from __future__ import annotations

import pytest
from demo.follow_me import FollowMe
from demo.following import Reference
from demo.listening import listening
from demo.stage import only_stream
from demo.table import StageResult
from tests.daemon.plugins import talker
from tests.kit.payloads import Part
from tests.kit.running_host import RunningHost

pytestmark = pytest.mark.daemon

ECHO = '''"""Says again what it hears."""
from nondum.sdk import Fragment, Output, Unit, behaviour, hookimpl

DOMAIN = """
(define (domain echo)
  (:predicates (echoed ?s - text))
  (:action repeat
    :parameters (?u - sensor ?s - text ?o - text ?h - host)
    :precondition (and (ready ?u) (flowing ?s) (from ?s ?h) (output ?u ?o) (free ?o))
    :effect (and (not (free ?o)) (echoed ?o))))
"""

@hookimpl
def units():
    return [Unit("cliff", "sensor", outputs=(Output("again", "text"),))]

@hookimpl
def fragments():
    return [Fragment("echo.pddl", DOMAIN)]

@behaviour("repeat", action="(repeat ?u - sensor ?s - text ?o - text ?h - host)", lasting=True)
async def repeat(ctx, u, s, o, h):
    words, again = ctx.input(s), ctx.output(o)
    again.send(await words.next())
    await ctx.established()
    async for word in words:
        again.send(word)
'''
LISTENS = """
    async for word in words:
        again.send(word)
"""
NEVER_HALTS = """
    while True:
        try:
            again.send(await words.next())
        except BaseException:
            pass
"""
WHEEL = '''"""Turns while it is driven."""
import math
import time

from nondum.sdk import Fragment, Header, Output, Pose, Unit, behaviour, hookimpl

DOMAIN = """
(define (domain wheel)
  (:predicates (echoed ?s - text) (rolled ?h - host))
  (:action roll
    :parameters (?u - base ?s - text ?h - host)
    :precondition (and (ready ?u) (on ?u ?h) (idle ?u) (echoed ?s))
    :effect (and (not (idle ?u)) (rolled ?h))))
"""
RATE = 0.5
motion = {"heading": 0.0, "rate": 0.0}

@hookimpl
def units():
    return [Unit("wheel", "base", outputs=(Output("odometry", "pose", always=True),))]

@hookimpl
def fragments():
    return [Fragment("wheel.pddl", DOMAIN)]

@hookimpl
async def start(ctx):
    ctx.spawn(move(ctx))

async def move(ctx):
    output = ctx.output("odometry")
    while True:
        await ctx.sleep(0.05)
        motion["heading"] += 0.05 * motion["rate"]
        half = motion["heading"] / 2
        turned = (0.0, 0.0, math.sin(half), math.cos(half))
        output.send(Pose(Header(stamp_s=time.monotonic()), (0.0, 0.0, 0.0), turned))

@behaviour("roll", action="(roll ?u - base ?s - text ?h - host)", lasting=True)
async def roll(ctx, u, s, h):
    await ctx.input(s).next()
    motion["rate"] = RATE
    await ctx.established()
    try:
        await ctx.sleep(3600)
    finally:
        motion["rate"] = 0.0
'''
AT_LAST = """
    finally:
        motion["rate"] = 0.0
"""
AT_LAST_SLOWER = AT_LAST.replace("0.0", "RATE / 5")


def lost(host: RunningHost, echo: str, wheel: str) -> StageResult:
    """How the stage ends when the drive that everything hangs on is pulled."""
    host.bring("echo", Part("echo", echo))
    host.bring("wheel", Part("wheel", wheel))
    drive = host.bring("talk", talker())
    host.until_goal(host.want("(rolled spot)"), "holds")
    with listening(host.control, only_stream(host, "pose")["stream"]) as body:
        return FollowMe(host, body, Reference({}), "roll").lose(drive, name="pulled")


def test_robot_that_halts_and_stands_passes(host: RunningHost) -> None:
    result = lost(host, ECHO, WHEEL)
    assert result.reached, result.measure
    assert "talker used to supply it" in result.measure


def test_behaviour_that_never_halts_fails(host: RunningHost) -> None:
    result = lost(host, changed(ECHO, LISTENS, NEVER_HALTS), WHEEL)
    assert not result.reached
    assert "BUT what echo did" in result.measure


def test_body_that_goes_on_turning_fails(host: RunningHost) -> None:
    result = lost(host, ECHO, changed(WHEEL, AT_LAST, AT_LAST_SLOWER))
    assert not result.reached
    assert result.measure.endswith("BUT the body does not stand")


def changed(source: str, old: str, new: str) -> str:
    """A plugin that does one thing otherwise."""
    assert old in source
    return source.replace(old, new)

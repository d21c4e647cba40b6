"""A plugin with one unit, `it`, and one behaviour, `do`, whose body a test writes."""

from __future__ import annotations

from tests.kit.workers import HOST, WorkersUnderTest

from nondum.host.workers.call import Call
from nondum.host.workers.spec import Limits, WorkerSpec
from nondum.sdk.description import Behaviour, Unit

DO = Behaviour("do", "(do ?u - sensor)")
IT = Unit("it", "sensor")
_SOURCE = """
import array, asyncio, os, shutil, signal, socket, subprocess, sys, threading, time, tty
from nondum.sdk import Unit, behaviour, hookimpl

@hookimpl
def units():
    return (Unit("it", "sensor"),)

{more}

@behaviour("do", action="(do ?u - sensor)")
async def do(ctx, u):
    {body}
"""


def plugin(body: str, more: str = "") -> str:
    """Its source; `body` is of a coroutine with `ctx` and `u`, `more` stands before it."""
    return _SOURCE.replace("{more}", more).replace("{body}", body.replace("\n", "\n    "))


def guest_spec(
    tested: WorkersUnderTest,
    body: str,
    more: str = "",
    *,
    name: str = "guest",
    limits: Limits | None = None,
) -> WorkerSpec:
    """Write it as the plugin of a component, and say how to start that."""
    source = plugin(body, more)
    return tested.spec(name, source, behaviours=(DO,), units=(IT,), limits=limits)


def do(tested: WorkersUnderTest, name: str = "guest") -> Call:
    """Have it do its thing."""
    return tested.behave(name, "do", u=f"{HOST}__{name}__it")

"""A plugin that does what plugins should not, for the SDK's own tests."""

from __future__ import annotations

import logging
import os
import sys

from nondum.sdk import BehaviourFailed, Context, ThreadContext, Unit, behaviour, hookimpl


@hookimpl
def units() -> list[Unit]:
    return [Unit("mule", "base")]


@hookimpl
async def translate_goal(ctx: Context, words: str) -> dict[str, str]:
    raise KeyError(words)


@behaviour("refuse-to-halt", action="(refuse-to-halt ?u - base)", lasting=True)
def refuse_to_halt(ctx: ThreadContext, u: str) -> None:
    ctx.established()
    while True:
        pass


@behaviour("exit", action="(exit ?u - base)")
def leave(ctx: ThreadContext, u: str) -> None:
    sys.exit("leaving")


@behaviour("die", action="(die ?u - base)")
async def die(ctx: Context, u: str) -> None:
    os._exit(7)


@behaviour("stop-iterating", action="(stop-iterating ?u - base)")
def stop_iterating(ctx: ThreadContext, u: str) -> None:
    next(iter(()))


@behaviour("shout", action="(shout ?u - base)")
def shout(ctx: ThreadContext, u: str) -> None:
    for i in range(100_000):
        logging.getLogger("anywhere").warning("hee-haw %d", i)
    raise BehaviourFailed("hoarse")

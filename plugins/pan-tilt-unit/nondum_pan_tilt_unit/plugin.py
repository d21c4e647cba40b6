"""A pan-tilt unit of the PTU-D46 class, with a laser: points at what has a bearing."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager

from nondum.sdk import (
    Bearing,
    BehaviourFailed,
    Context,
    DeviceNeed,
    Fragment,
    Phrase,
    Problem,
    Unit,
    behaviour,
    hookimpl,
)
from nondum.sdk.serial_line import SerialLine
from nondum_pan_tilt_unit import head, relay
from nondum_pan_tilt_unit.head import Head
from nondum_pan_tilt_unit.pointer import Pointer
from nondum_pan_tilt_unit.relay import Laser
from nondum_pan_tilt_unit.settings import Settings

HEAD = "head"
LASER = "laser-relay"
_CHECK_EVERY_S = 0.2


@hookimpl
def describe() -> dict[str, str]:
    return {"summary": "Points a laser at what has a bearing, with a pan-tilt unit."}


@hookimpl
def units() -> tuple[Unit, ...]:
    return (Unit("laser-pointer", "pointer"),)


@hookimpl
def devices() -> tuple[DeviceNeed, ...]:
    adapter = {"SUBSYSTEM": "tty", "ID_VENDOR_ID": "0403", "ID_MODEL": "PTU-D46*"}
    ch340 = {"SUBSYSTEM": "tty", "ID_VENDOR_ID": "1a86", "ID_MODEL_ID": "7523"}
    return (DeviceNeed(HEAD, adapter), DeviceNeed(LASER, ch340))


@hookimpl
def fragments() -> tuple[Fragment, ...]:
    return (Fragment.from_package("nondum_pan_tilt_unit", "domain.pddl"),)


@hookimpl
def phrases() -> tuple[Phrase, ...]:
    patterns = ("[please] point at {t:target}", "[please] point the laser at {t:target}")
    return tuple(Phrase(pattern, "(pointing self ?t)", "maintain") for pattern in patterns)


@hookimpl
async def start(ctx: Context) -> None:
    """Refuse wrong settings; switch off a laser that was left on when a worker was killed."""
    Settings.parse(ctx.settings)
    _darken(ctx)


@hookimpl
async def stop(ctx: Context) -> None:
    _darken(ctx)


@behaviour("point", action="(point ?u - pointer ?t - target ?h - host)", lasting=True)
async def point(ctx: Context, u: str, t: str, h: str) -> None:
    """Turn to the target's bearing, light it with the laser, and stay on it as the bearing changes.

    Fails with DEVICE_MISSING, SERIAL_FAILED, the PTU_ codes of `head` and PTU_MOVED.
    """
    with _pointer(ctx) as pointer:
        await pointer.ready()
        await _follow(ctx, pointer, u, t, h)
        await ctx.established()
        while True:
            await asyncio.sleep(_CHECK_EVERY_S)
            await pointer.check()
            await _follow(ctx, pointer, u, t, h)


async def _follow(ctx: Context, pointer: Pointer, u: str, t: str, h: str) -> None:
    known = ctx.value("bearing-known", t, h)
    if not isinstance(known, Bearing):
        raise BehaviourFailed(f"the bearing of {t} is no bearing: {known!r}")
    await pointer.point(ctx.transform(known, to=u).direction)


@contextmanager
def _pointer(ctx: Context) -> Iterator[Pointer]:
    """Open both devices; on leaving, the laser is switched off before they are closed."""
    nodes, settings = [_node(ctx, name) for name in (HEAD, LASER)], Settings.parse(ctx.settings)
    with (
        SerialLine(nodes[0], head.BAUD) as head_line,
        SerialLine(nodes[1], relay.BAUD) as laser_line,
        Pointer(
            Head(head_line, answer_s=settings.answer_s), Laser(laser_line), settings
        ) as pointer,
    ):
        yield pointer


def _node(ctx: Context, name: str) -> str:
    device = ctx.device(name)
    if device is None:
        raise BehaviourFailed(
            Problem("DEVICE_MISSING", f"the {name} is not plugged in", where="pan-tilt-unit")
        )
    return device.node


def _darken(ctx: Context) -> None:
    """Switch the laser off as far as there is one; a behaviour tells of a broken relay better."""
    device = ctx.device(LASER)
    if device is None:
        return
    try:
        with SerialLine(device.node, relay.BAUD) as line:
            Laser(line).off()
    except BehaviourFailed as error:
        ctx.log.warning("the laser could not be switched off: %s", error)

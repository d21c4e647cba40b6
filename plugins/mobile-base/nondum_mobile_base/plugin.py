"""A simulated mobile base: obeys velocities within limits, and tells its odometry."""

from __future__ import annotations

import math
import time

from nondum.sdk import (
    Context,
    Fragment,
    Header,
    Output,
    Phrase,
    Pose,
    Twist,
    Unit,
    behaviour,
    hookimpl,
)
from nondum.sdk.settings import parse_settings
from nondum_mobile_base.settings import Settings
from nondum_mobile_base.unicycle import Command, Motion, moved

PERIOD_S = 0.05


class MobileBase:
    """A simulated mobile base: obeys velocities within limits, and tells its odometry."""

    def __init__(self) -> None:
        self._command: Command | None = None

    @hookimpl
    def describe(self) -> dict[str, str]:
        return {"summary": "A simulated base that obeys velocities and tells its odometry."}

    @hookimpl
    def units(self) -> tuple[Unit, ...]:
        return (Unit("base", "base", outputs=(Output("odometry", "pose", always=True),)),)

    @hookimpl
    def fragments(self) -> tuple[Fragment, ...]:
        return (Fragment.from_package("nondum_mobile_base", "domain.pddl"),)

    @hookimpl
    def phrases(self) -> tuple[Phrase, ...]:
        pattern = "[please] follow {c:class} [through {words:text}]"
        return (Phrase(pattern, "(following self ?c)", "maintain"),)

    @hookimpl
    async def start(self, ctx: Context) -> None:
        """Stand where the settings say, and tell odometry from now on."""
        settings = parse_settings(Settings, ctx.settings, where=ctx.component)
        ctx.spawn(self._move(ctx, settings))

    @behaviour("drive", action="(drive ?u - base ?s - twist ?h - host ?c - class)", lasting=True)
    async def drive(self, ctx: Context, u: str, s: str, h: str, c: str) -> None:
        """Obey a stream of velocities until halted; brake when it falls silent.

        Fails with FRAME_UNKNOWN when a velocity is in a frame that has no known place on the body.
        """
        is_established = False
        try:
            async for twist in ctx.input(s):
                self._obey(ctx, twist)
                if not is_established:
                    await ctx.established()
                    is_established = True
        finally:
            self._command = None

    def _obey(self, ctx: Context, twist: Twist) -> None:
        if twist.header.frame_id not in ("", ctx.host):
            twist = ctx.transform(twist, to=ctx.host)
        # Its own stamp: a command that was long under way is as old as it is.
        stamp_s = min(twist.header.stamp_s, time.monotonic())
        self._command = Command(stamp_s, twist.linear[0], twist.angular[2])

    async def _move(self, ctx: Context, settings: Settings) -> None:
        output, motion, limits = ctx.output("odometry"), settings.start, settings.limits
        then_s = time.monotonic()
        while True:
            await ctx.sleep(PERIOD_S)
            now_s = time.monotonic()
            motion = moved(motion, self._command, now_s=now_s, dt_s=now_s - then_s, limits=limits)
            output.send(odometry(motion, ctx.host, now_s))
            then_s = now_s


def odometry(motion: Motion, host: str, stamp_s: float) -> Pose:
    """The motion as nav_msgs/Odometry: the body `host` in the frame `<host>/odom`."""
    half = motion.heading / 2
    return Pose(
        Header(stamp_s=stamp_s, frame_id=f"{host}/odom"),
        position=(motion.x, motion.y, 0.0),
        orientation=(0.0, 0.0, math.sin(half), math.cos(half)),
        child_frame_id=host,
        twist=Twist(
            Header(stamp_s=stamp_s, frame_id=host),
            linear=(motion.speed_m_s, 0.0, 0.0),
            angular=(0.0, 0.0, motion.turn_rad_s),
        ),
    )

"""Follows one person: detections in, velocities out."""

from __future__ import annotations

import math
import time

from nondum.sdk import (
    BehaviourFailed,
    Context,
    Detections,
    Fragment,
    Header,
    Input,
    InputStream,
    Output,
    Phrase,
    Twist,
    Unit,
    behaviour,
    hookimpl,
)
from nondum.sdk.settings import parse_settings
from nondum_visual_tracker.controller import Command, Mode
from nondum_visual_tracker.crowd import Crowd
from nondum_visual_tracker.eye import sightings
from nondum_visual_tracker.follower import Follower
from nondum_visual_tracker.settings import Settings
from nondum_visual_tracker.sighting import Sighting

PERIOD_S = 0.05
WATCH_HITS = 3
"""Sightings of one person that count as found."""


@hookimpl
def describe() -> dict[str, str]:
    return {"summary": "Keeps one person ahead of the body."}


@hookimpl
def units() -> tuple[Unit, ...]:
    return (
        Unit(
            "tracker",
            "tracker",
            outputs=(Output("steering", "twist"),),
            inputs=(
                Input("odometry", "pose", of="base"),
                Input("depth", "depth", of="camera"),
            ),
        ),
    )


@hookimpl
def fragments() -> tuple[Fragment, ...]:
    return (Fragment.from_package("nondum_visual_tracker", "domain.pddl"),)


@hookimpl
def phrases() -> tuple[Phrase, ...]:
    return (Phrase("[please] look for {c:class}", "(found ?c self)", kind="do"),)


@hookimpl
async def start(ctx: Context) -> None:
    """Refuse wrong settings."""
    parse_settings(Settings, ctx.settings, where=ctx.component)


@behaviour(
    "track",
    action="(track ?u - tracker ?d - detections ?o - twist ?h - host ?c - class)",
    lasting=True,
)
async def track(ctx: Context, u: str, d: str, o: str, h: str, c: str) -> None:
    """Pick the person nearest straight ahead, and steer to keep them there, until halted.

    Established when a person was picked. Fails with TARGET_LOST when no person was seen for
    `give_up_s`, and with FRAME_UNKNOWN when the camera's mount is not known.
    """
    settings = parse_settings(Settings, ctx.settings, where=ctx.component)
    eye, follower = _Eye(ctx, d, c, settings, body=h), Follower(settings.gains)
    odometry, output = ctx.optional_input("odometry"), ctx.output(o)
    began_s, mode = time.monotonic(), Mode.ACQUIRING
    while True:
        now_s = time.monotonic()
        pose = odometry.latest
        if pose is not None and pose.child_frame_id in ("", h):
            follower.heading.measured(pose.header.stamp_s, pose.yaw_rad)
        if (news := eye.look()) is not None:
            follower.saw(*news)
        command = follower.command(now_s)
        output.send(_twist(h, command))
        if command.mode is not mode:
            if mode is Mode.ACQUIRING:
                await ctx.established()
            mode = command.mode
            ctx.progress(float(mode is Mode.FOLLOWING), mode.value)
        unseen_s = now_s - began_s if mode is Mode.ACQUIRING else follower.unseen_s(now_s)
        _give_up(c, unseen_s, settings)
        await ctx.sleep(PERIOD_S)


@behaviour("watch", action="(watch ?u - tracker ?d - detections ?h - host ?c - class)")
async def watch(ctx: Context, u: str, d: str, h: str, c: str) -> None:
    """Wait until somebody has been seen for certain.

    Fails with TARGET_LOST when no person was seen within `give_up_s`, and with FRAME_UNKNOWN.
    """
    settings = parse_settings(Settings, ctx.settings, where=ctx.component)
    eye, crowd = _Eye(ctx, d, c, settings, body=h), Crowd(memory_s=settings.coast_s)
    began_s = time.monotonic()
    while not any(person.hits >= WATCH_HITS for person in crowd.tracks):
        if (news := eye.look()) is not None:
            crowd = crowd.seen(*news)
        _give_up(c, time.monotonic() - began_s, settings)
        await ctx.sleep(PERIOD_S)


class _Eye:
    """Reads detections as sightings, each message once. The body may be another host's than the
    one that this runs on."""

    def __init__(
        self, ctx: Context, stream: str, class_id: str, settings: Settings, *, body: str
    ) -> None:
        self._ctx = ctx
        self._body = body
        self._input: InputStream[Detections] = ctx.input(stream)
        self._depth = ctx.optional_input("depth")
        self._class_id = class_id
        self._settings = settings
        self._seen_s = -math.inf

    def look(self) -> tuple[tuple[Sighting, ...], float] | None:
        """Sightings and their stamp; None when there is nothing new."""
        newest = self._input.latest
        if newest is None or newest.header.stamp_s <= self._seen_s:
            return None
        self._seen_s = newest.header.stamp_s
        seen = sightings(
            newest,
            self._class_id,
            to_body=lambda bearing: self._ctx.transform(bearing, to=self._body),
            field_of_view_deg=self._settings.field_of_view_deg,
            depth=self._depth.latest,
        )
        return seen, self._seen_s


def _twist(body: str, command: Command) -> Twist:
    return Twist(
        Header(frame_id=body),
        linear=(command.speed_m_s, 0.0, 0.0),
        angular=(0.0, 0.0, command.turn_rad_s),
    )


def _give_up(class_id: str, unseen_s: float, settings: Settings) -> None:
    if unseen_s > settings.give_up_s:
        raise BehaviourFailed(
            f"no {class_id} was seen for {settings.give_up_s:g} s", code="TARGET_LOST"
        )

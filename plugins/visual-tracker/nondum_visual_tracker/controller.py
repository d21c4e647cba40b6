"""From where the person is to how the body moves: the control law."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass

from nondum_visual_tracker.sighting import range_by_height
from nondum_visual_tracker.track import Track


class Mode(enum.Enum):
    """What the follower is doing."""

    ACQUIRING = "acquiring"
    """No person has been picked yet: stand still."""
    FOLLOWING = "following"
    """The person is in sight."""
    COASTING = "coasting"
    """Unseen for a moment: go on turning as they went, and slow down."""
    STOPPED = "stopped"
    """Unseen for longer: stand still and wait for them."""
    SEARCHING = "searching"
    """Unseen for long: turn on the spot, the way they went."""


@dataclass(frozen=True, slots=True)
class Gains:
    """The control law's numbers; limits are hard."""

    turn_gain: float = 2.5
    """rad/s of turning per radian of error."""
    feed_forward: float = 1.0
    """Share of the person's own bearing rate that is turned along with."""
    dead_band_rad: float = math.radians(1.0)
    """Errors below it are left alone."""
    max_turn_rad_s: float = 1.2
    approach_gain: float = 0.5
    """m/s per metre of distance too many."""
    distance_m: float = 2.0
    """How far behind the person to stay."""
    max_speed_m_s: float = 0.6
    max_reverse_m_s: float = 0.2
    facing_rad: float = math.radians(40.0)
    """Beyond this error the body turns without driving."""
    person_m: float = 1.7
    """Height that a person is taken to have where nothing measures the distance."""
    coast_s: float = 1.5
    """Unseen for so long: coasting."""
    stop_s: float = 3.0
    """Unseen for so long: stopped; longer: searching."""
    search_rad_s: float = 0.4


@dataclass(frozen=True, slots=True)
class Command:
    """What the body shall do."""

    speed_m_s: float = 0.0
    turn_rad_s: float = 0.0
    mode: Mode = Mode.ACQUIRING


def steer(target: Track, heading: float, now_s: float, gains: Gains) -> Command:
    """Turn towards and keep the distance to the person believed in by `target`.

    Detections are old when they come; `target` is carried forward to `now_s`, so the law acts on
    where the person is by now.
    """
    unseen_s = now_s - target.seen_s
    now = target.at(now_s)
    error = now.azimuth - heading
    off = math.copysign(max(abs(error) - gains.dead_band_rad, 0.0), error)
    turn = gains.turn_gain * off + gains.feed_forward * now.rate
    fade = 1.0 - min(max(unseen_s - gains.coast_s / 2, 0.0) / (gains.coast_s / 2), 1.0)
    return Command(
        speed_m_s=_speed(now, error, gains) * fade,
        turn_rad_s=_limited(turn, gains.max_turn_rad_s),
        mode=Mode.FOLLOWING if unseen_s <= gains.coast_s / 2 else Mode.COASTING,
    )


def without_target(unseen_s: float, side: float, gains: Gains) -> Command:
    """What to do when the person has been unseen for `unseen_s`; `side` is the way they went,
    positive to the left."""
    if unseen_s <= gains.stop_s:
        return Command(mode=Mode.STOPPED)
    return Command(turn_rad_s=math.copysign(gains.search_rad_s, side), mode=Mode.SEARCHING)


def _speed(target: Track, error: float, gains: Gains) -> float:
    distance = target.range_m
    if distance is None:
        distance = range_by_height(target.height, person_m=gains.person_m)
    speed = gains.approach_gain * (distance - gains.distance_m)
    speed = min(max(speed, -gains.max_reverse_m_s), gains.max_speed_m_s)
    return speed * max(0.0, 1.0 - abs(error) / gains.facing_rad)


def _limited(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)

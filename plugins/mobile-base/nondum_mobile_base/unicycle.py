"""A unicycle: what a differential-drive base does with a velocity command."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace


@dataclass(frozen=True, slots=True)
class Limits:
    """What the simulated base can do; hard limits."""

    speed_m_s: float = 0.8
    reverse_m_s: float = 0.3
    turn_rad_s: float = 1.5
    acceleration_m_s2: float = 1.0
    turn_acceleration_rad_s2: float = 4.0
    deadline_s: float = 0.3
    """Without a command younger than this the base brakes to a stand."""

    def __post_init__(self) -> None:
        for name in ("acceleration_m_s2", "turn_acceleration_rad_s2", "deadline_s"):
            if getattr(self, name) <= 0:
                raise ValueError(f"{name} must be positive")


@dataclass(frozen=True, slots=True)
class Motion:
    """Where the base is, relative to where it began, and how it moves.

    Metres and radians; x ahead of the start, y to its left, heading to the left and never wrapped.
    """

    x: float = 0.0
    y: float = 0.0
    heading: float = 0.0
    speed_m_s: float = 0.0
    turn_rad_s: float = 0.0

    @property
    def is_still(self) -> bool:
        """True when it neither drives nor turns."""
        return self.speed_m_s == 0.0 and self.turn_rad_s == 0.0


@dataclass(frozen=True, slots=True)
class Command:
    """The velocity asked for, and when it was received."""

    stamp_s: float
    speed_m_s: float
    turn_rad_s: float


def moved(
    motion: Motion, command: Command | None, *, now_s: float, dt_s: float, limits: Limits
) -> Motion:
    """The motion `dt_s` later, at `now_s`, under the newest command.

    Speeds approach the command within the limits of acceleration; a command older than the
    deadline counts as a command to stand.
    """
    speed, turn = _wanted(command, now_s, limits)
    speed = _approached(motion.speed_m_s, speed, limits.acceleration_m_s2 * dt_s)
    turn = _approached(motion.turn_rad_s, turn, limits.turn_acceleration_rad_s2 * dt_s)
    mean_speed, mean_turn = (motion.speed_m_s + speed) / 2, (motion.turn_rad_s + turn) / 2
    towards = motion.heading + mean_turn * dt_s / 2
    return replace(
        motion,
        x=motion.x + mean_speed * math.cos(towards) * dt_s,
        y=motion.y + mean_speed * math.sin(towards) * dt_s,
        heading=motion.heading + mean_turn * dt_s,
        speed_m_s=speed,
        turn_rad_s=turn,
    )


def _wanted(command: Command | None, now_s: float, limits: Limits) -> tuple[float, float]:
    if command is None or now_s - command.stamp_s > limits.deadline_s:
        return 0.0, 0.0
    speed = min(max(command.speed_m_s, -limits.reverse_m_s), limits.speed_m_s)
    turn = min(max(command.turn_rad_s, -limits.turn_rad_s), limits.turn_rad_s)
    return speed, turn


def _approached(value: float, wanted: float, step: float) -> float:
    return value + min(max(wanted - value, -step), step)

"""Whether the laser pointed at the source: judged from the truth alone, after the run.

Reads the scenario, and the log that the emulated pan-tilt unit wrote of what its head and laser
really did. Nothing that a driver, a planner or the host said is looked at.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from demo.scenario import Scenario

TOLERANCE_RAD = math.radians(3.0)
HELD_S = 1.0


@dataclass(frozen=True, slots=True)
class Truth:
    """What head and laser really did at one moment."""

    at_s: float
    """On the machine's monotonic clock."""
    pan_rad: float
    tilt_rad: float
    laser: bool


@dataclass(frozen=True, slots=True)
class Score:
    """How the run ended."""

    angle_rad: float
    """The largest between laser and source while it had to be held; π with nothing to judge."""
    lit: bool
    """The laser was on all that time."""

    @property
    def is_reached(self) -> bool:
        return self.lit and self.angle_rad <= TOLERANCE_RAD

    def __str__(self) -> str:
        light = "on" if self.lit else "off"
        return f"laser {light}, {math.degrees(self.angle_rad):.2f}° from the source"


def read_log(path: Path) -> list[Truth]:
    """What the pan-tilt emulator wrote; a last line cut short is left out."""
    lines = path.read_text(encoding="utf-8").split("\n")[:-1]
    return [Truth(**json.loads(line)) for line in lines]


def score(scenario: Scenario, truths: Sequence[Truth], *, end_s: float | None = None) -> Score:
    """Judge the last second before `end_s` (else before the log's end).

    The moment before that second counts too: the head was there when the second began.
    """
    end = end_s if end_s is not None else max((truth.at_s for truth in truths), default=0.0)
    judged = list(_during(truths, end - HELD_S, end))
    return Score(
        angle_rad=max((off_source_rad(scenario, truth) for truth in judged), default=math.pi),
        lit=bool(judged) and all(truth.laser for truth in judged),
    )


def off_source_rad(scenario: Scenario, truth: Truth) -> float:
    """The angle between the laser's ray and the way from the laser to the source."""
    flat = math.cos(truth.tilt_rad)
    ray = np.array(
        (
            flat * math.cos(truth.pan_rad),
            flat * math.sin(truth.pan_rad),
            math.sin(truth.tilt_rad),
        )
    )
    way = scenario.pointer.seen(scenario.source_m)
    cross = float(np.linalg.norm(np.cross(ray, way)))
    return math.atan2(cross, float(ray @ way))


def _during(truths: Iterable[Truth], begin_s: float, end_s: float) -> Iterable[Truth]:
    before = None
    for truth in sorted(truths, key=lambda truth: truth.at_s):
        if truth.at_s < begin_s:
            before = truth
        elif truth.at_s <= end_s:
            if before is not None:
                yield before
                before = None
            yield truth
    if before is not None and before.at_s >= begin_s - HELD_S:
        yield before

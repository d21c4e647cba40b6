"""The truth of one pointing run: where the source is and how the instruments are mounted.

Written for the emulators, which simulate it, and for the scorer, which reads it after the run.
Nothing of it reaches a driver but through the bytes that the instruments send; the mounts also go
to the host, as a person who mounts instruments would enter them (`nondum mount`).
"""

from __future__ import annotations

import json
import math
import random
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from demo.emulators.pose import Floats, Mount, rotation

DISTANCES_M = (15.0, 40.0)
REACH_PAN_RAD = math.radians(150)
REACH_TILT_RAD = (math.radians(-40), math.radians(26))
DECISIVE_RAD = math.radians(15)
"""How far beside the source the laser must fall if a mount is left out of account."""
PARALLAX_RAD = math.radians(1.2)
"""A bearing says nothing of distance: how far apart the instruments may see the source."""


@dataclass(frozen=True, slots=True)
class Scenario:
    """All that is random in one run."""

    seed: int
    """Also of the emulators' own dice."""
    source_m: tuple[float, float, float]
    """In the body frame."""
    activity_bq: float
    """Of caesium-137."""
    camera: Mount
    pointer: Mount
    pan_rad: float
    """Where the pan-tilt unit points when it is switched on."""
    tilt_rad: float
    seized: bool = False
    """The pan-tilt unit counts steps and does not move: its gears are stuck."""

    @classmethod
    def read(cls, path: Path) -> Scenario:
        data = json.loads(path.read_text(encoding="utf-8"))
        for name in ("camera", "pointer"):
            data[name] = Mount(**{key: tuple(value) for key, value in data[name].items()})
        return cls(**{**data, "source_m": tuple(data["source_m"])})

    def write(self, path: Path) -> None:
        path.write_text(json.dumps(asdict(self), indent=2) + "\n", encoding="utf-8")


def random_scenario(seed: int) -> Scenario:
    """A run that a person could set up: the source within the pointer's reach, little parallax; and
    one that shows whether mounts were used: without either or both the laser would miss."""
    dice = random.Random(seed)
    while True:
        camera, pointer = _mount(dice), _mount(dice)
        source = _source(dice)
        if is_fair(source, camera, pointer) and is_decisive(source, camera, pointer):
            break
    return Scenario(
        seed=seed,
        source_m=source,
        activity_bq=dice.uniform(2e9, 6e9),
        camera=camera,
        pointer=pointer,
        pan_rad=dice.uniform(-REACH_PAN_RAD, REACH_PAN_RAD),
        tilt_rad=dice.uniform(*REACH_TILT_RAD),
    )


def is_fair(source_m: tuple[float, float, float], camera: Mount, pointer: Mount) -> bool:
    """Whether the pointer can turn to the source, and both instruments see it the same way."""
    seen = _unit(pointer.seen(source_m))
    pan, tilt = math.atan2(seen[1], seen[0]), math.asin(seen[2])
    from_camera = _unit(np.asarray(source_m) - np.asarray(camera.xyz))
    from_pointer = _unit(np.asarray(source_m) - np.asarray(pointer.xyz))
    parallax = math.acos(min(1.0, float(from_camera @ from_pointer)))
    low, high = REACH_TILT_RAD
    return abs(pan) <= REACH_PAN_RAD and low <= tilt <= high and parallax <= PARALLAX_RAD


def is_decisive(source_m: tuple[float, float, float], camera: Mount, pointer: Mount) -> bool:
    """Whether aims that leave out the camera's mount, the pointer's or both miss by far."""
    way = _unit(np.asarray(source_m))
    seen, turn = rotation(camera.rpy).T @ way, rotation(pointer.rpy)
    misses = (seen, turn @ way, turn @ seen)  # each in the body frame, against `way`
    return all(float(miss @ way) < math.cos(DECISIVE_RAD) for miss in misses)


def _mount(dice: random.Random) -> Mount:
    """Within 0.3 m of the body's origin, any yaw, nearly upright."""
    while math.dist(xyz := _three(dice, 0.3), (0, 0, 0)) > 0.3:
        pass
    lean = math.radians(10)
    roll, pitch = dice.uniform(-lean, lean), dice.uniform(-lean, lean)
    return Mount(xyz=xyz, rpy=(roll, pitch, dice.uniform(-math.pi, math.pi)))


def _source(dice: random.Random) -> tuple[float, float, float]:
    distance = dice.uniform(*DISTANCES_M)
    azimuth = dice.uniform(-math.pi, math.pi)
    elevation = dice.uniform(math.radians(-10), math.radians(15))
    flat = distance * math.cos(elevation)
    return (
        flat * math.cos(azimuth),
        flat * math.sin(azimuth),
        distance * math.sin(elevation),
    )


def _three(dice: random.Random, size: float) -> tuple[float, float, float]:
    return dice.uniform(-size, size), dice.uniform(-size, size), dice.uniform(-size, size)


def _unit(vector: Floats) -> Floats:
    return np.asarray(vector / np.linalg.norm(vector))

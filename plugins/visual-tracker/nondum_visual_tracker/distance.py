"""Distances from a depth image, by a few pixels in the middle of a box."""

from __future__ import annotations

import math
import statistics
import struct
from collections.abc import Iterator

from nondum.sdk import BoundingBox2D, Depth

_SAMPLES = 5
_MIDDLE = 0.5
"""Share of the box that is looked at: its rim shows what is behind."""
_MM = 0.001


def distance_in(depth: Depth, box: BoundingBox2D, *, width: int, height: int) -> float | None:
    """The median distance in metres within a box of an image of `width` × `height` pixels that was
    taken by the same camera; None where the depth image has none."""
    across, down = depth.width / width, depth.height / height
    found = [
        distance
        for y in _spread(box.cy * down, box.height * down, depth.height)
        for x in _spread(box.cx * across, box.width * across, depth.width)
        if math.isfinite(distance := _at(depth, x, y)) and distance > 0
    ]
    return statistics.median(found) if found else None


def _spread(middle: float, size: float, end: int) -> Iterator[int]:
    for step in range(_SAMPLES):
        place = round(middle + (step / (_SAMPLES - 1) - 0.5) * _MIDDLE * size)
        if 0 <= place < end:
            yield place


def _at(depth: Depth, x: int, y: int) -> float:
    if depth.encoding == "16UC1":
        millimetres: int = struct.unpack_from("<H", depth.data, y * depth.step + 2 * x)[0]
        return millimetres * _MM
    metres: float = struct.unpack_from("<f", depth.data, y * depth.step + 4 * x)[0]
    return metres

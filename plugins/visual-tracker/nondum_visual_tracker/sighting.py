"""What one detection says in angles: where somebody is, and how far away."""

from __future__ import annotations

import math
from dataclasses import dataclass

from nondum.sdk.messages import BoundingBox2D, CameraModel


@dataclass(frozen=True, slots=True)
class Sighting:
    """Somebody, seen once."""

    azimuth: float
    """Radians to the left of a fixed direction."""
    height: float
    """Apparent height in radians."""
    score: float = 1.0
    range_m: float | None = None
    """Measured distance, where a depth image gave it."""


def assumed_camera(width: int, height: int, *, field_of_view_deg: float) -> CameraModel:
    """The pinhole camera to go by when an image came without a model."""
    focal = width / 2 / math.tan(math.radians(field_of_view_deg) / 2)
    return CameraModel(width, height, focal, focal, (width - 1) / 2, (height - 1) / 2)


def direction(camera: CameraModel, column: float, row: float) -> tuple[float, float, float]:
    """The unit vector through a pixel, in the camera's frame: x ahead, y left, z up."""
    y, z = (camera.cx - column) / camera.fx, (camera.cy - row) / camera.fy
    length = math.sqrt(1.0 + y * y + z * z)
    return 1.0 / length, y / length, z / length


def apparent_height(camera: CameraModel, box: BoundingBox2D) -> float:
    """The angle that a box spans from foot to head, in radians."""
    top = (camera.cy - (box.cy - box.height / 2)) / camera.fy
    bottom = (camera.cy - (box.cy + box.height / 2)) / camera.fy
    return math.atan(top) - math.atan(bottom)


def range_by_height(height: float, *, person_m: float) -> float:
    """The distance at which somebody `person_m` tall spans `height` radians.

    >>> round(range_by_height(0.4, person_m=1.7), 2)
    4.19
    """
    return person_m / 2 / math.tan(max(height, 1e-3) / 2)

"""Poses, velocities and bearings (geometry_msgs, nav_msgs/Odometry; axes and units of REP-103)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import ClassVar, TypeAlias

from nondum.sdk.frozen import frozen
from nondum.sdk.messages.fields import Message
from nondum.sdk.messages.header import Header

Vector: TypeAlias = tuple[float, float, float]
"""x forward, y left, z up."""
Quaternion: TypeAlias = tuple[float, float, float, float]
"""x, y, z, w; of length 1."""

UNIT_LENGTH_TOLERANCE = 1e-3


@frozen
class Twist(Message):
    """A velocity of a body (geometry_msgs/TwistStamped), in the axes of the header's frame.

    As a command it holds for 0.3 s: actuators stop when nothing fresher comes.
    """

    TYPE: ClassVar[str] = "twist"
    header: Header
    linear: Vector = (0.0, 0.0, 0.0)
    """m/s"""
    angular: Vector = (0.0, 0.0, 0.0)
    """rad/s"""


@frozen
class Pose(Message):
    """Where a frame is (geometry_msgs/PoseStamped; nav_msgs/Odometry when the child is named)."""

    TYPE: ClassVar[str] = "pose"
    header: Header
    position: Vector
    """m, in the header's frame"""
    orientation: Quaternion = (0.0, 0.0, 0.0, 1.0)
    """Of the child in the header's frame: x, y, z, w, of length 1."""
    child_frame_id: str = ""
    """The frame that is there; empty where only a place is meant."""
    twist: Twist | None = None
    """The child's velocity, in the child's own axes, m/s and rad/s."""

    @property
    def yaw_rad(self) -> float:
        """The heading: rotation about z, left positive, in -π..π."""
        x, y, z, w = self.orientation
        return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))

    def faults(self) -> Iterator[str]:
        """An orientation that is no rotation."""
        if not is_unit(self.orientation):
            yield "the orientation is not a quaternion of length 1"


@frozen
class Bearing(Message):
    """A direction to something, as seen from the origin of the header's frame."""

    TYPE: ClassVar[str] = "bearing"
    header: Header
    direction: Vector
    """Unit vector."""
    sigma_rad: float
    """Standard deviation of the direction, rad."""

    @classmethod
    def from_angles(
        cls, header: Header, *, azimuth_rad: float, elevation_rad: float, sigma_rad: float
    ) -> Bearing:
        """Make a bearing of an azimuth (left positive) and an elevation (up positive)."""
        flat = math.cos(elevation_rad)
        direction = (
            flat * math.cos(azimuth_rad),
            flat * math.sin(azimuth_rad),
            math.sin(elevation_rad),
        )
        return cls(header, direction, sigma_rad)

    @property
    def azimuth_rad(self) -> float:
        """Angle about z from x, left positive, in -π..π."""
        return math.atan2(self.direction[1], self.direction[0])

    @property
    def elevation_rad(self) -> float:
        """Angle above the xy plane, in -π/2..π/2."""
        return math.atan2(self.direction[2], math.hypot(self.direction[0], self.direction[1]))

    def faults(self) -> Iterator[str]:
        """A direction that is no unit vector, or a negative deviation."""
        if not is_unit(self.direction):
            yield "the direction is not a vector of length 1"
        if self.sigma_rad < 0:
            yield f"sigma_rad {self.sigma_rad} is negative"


def is_unit(values: tuple[float, ...]) -> bool:
    """Whether a vector or quaternion has length 1."""
    return abs(math.hypot(*values) - 1) <= UNIT_LENGTH_TOLERANCE

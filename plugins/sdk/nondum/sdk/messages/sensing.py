"""What a body senses of itself: where it is, how it moves, what its battery has left.

After sensor_msgs/NavSatFix, Imu and BatteryState, with units in the names. What is not known is
None, where ROS has NaN or -1.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar, TypeAlias

from nondum.sdk.frozen import frozen
from nondum.sdk.messages.fields import Message
from nondum.sdk.messages.header import Header
from nondum.sdk.messages.motion import Quaternion, Vector, is_unit

Covariance: TypeAlias = tuple[float, float, float, float, float, float, float, float, float]
"""3×3, row by row; symmetric, its diagonal not negative."""


@frozen
class GpsFix(Message):
    """A position on Earth by satellites (sensor_msgs/NavSatFix), in WGS 84.

    The header's frame is the antenna's. For a pose in a `map` or `odom` frame see REP-105: that is
    a `Pose`, which another component works out.
    """

    TYPE: ClassVar[str] = "gps-fix"
    STATUS: ClassVar[tuple[str, ...]] = ("none", "fix", "sbas", "gbas")
    header: Header
    latitude_deg: float
    """Degrees, north positive, -90..90."""
    longitude_deg: float
    """Degrees, east positive, -180..180."""
    altitude_m: float | None = None
    """Metres above the WGS 84 ellipsoid."""
    covariance: Covariance | None = None
    """m², of east, north and up, in this order."""
    status: str = "fix"
    """`none` (the position is not to be used), `fix`, `sbas` or `gbas` (augmented by satellites or
    stations on the ground)."""

    def faults(self) -> Iterator[str]:
        """A place that is not on Earth, an unknown status, an impossible covariance."""
        if not -90 <= self.latitude_deg <= 90:
            yield f"latitude_deg {self.latitude_deg} is not within -90..90"
        if not -180 <= self.longitude_deg <= 180:
            yield f"longitude_deg {self.longitude_deg} is not within -180..180"
        if self.status not in self.STATUS:
            yield f"status {self.status!r} is none of {', '.join(self.STATUS)}"
        yield from _covariance_faults("covariance", self.covariance)


@frozen
class ImuData(Message):
    """What an inertial measurement unit senses (sensor_msgs/Imu), along its frame's axes."""

    TYPE: ClassVar[str] = "imu-data"
    header: Header
    orientation: Quaternion | None = None
    """Of the frame in the world (REP-103: x east, z up); None where it is not worked out."""
    angular_velocity: Vector | None = None
    """rad/s"""
    linear_acceleration: Vector | None = None
    """m/s², gravity included: at rest and level, z is +9.8 (REP-145)."""
    orientation_covariance: Covariance | None = None
    """rad², about x, y and z."""
    angular_velocity_covariance: Covariance | None = None
    """(rad/s)²"""
    linear_acceleration_covariance: Covariance | None = None
    """(m/s²)²"""

    def faults(self) -> Iterator[str]:
        """An orientation that is no rotation, or impossible covariances."""
        if self.orientation is not None and not is_unit(self.orientation):
            yield "the orientation is not a quaternion of length 1"
        for name in ("orientation", "angular_velocity", "linear_acceleration"):
            field = f"{name}_covariance"
            yield from _covariance_faults(field, getattr(self, field))


@frozen
class BatteryState(Message):
    """How a battery is (sensor_msgs/BatteryState)."""

    TYPE: ClassVar[str] = "battery-state"
    STATUS: ClassVar[tuple[str, ...]] = (
        *("unknown", "charging", "discharging", "not-charging", "full"),
    )
    header: Header
    voltage_v: float
    """V"""
    current_a: float | None = None
    """A, negative while it discharges."""
    charge_ah: float | None = None
    """Ah that are left."""
    capacity_ah: float | None = None
    """Ah when it is full, as it is now."""
    fraction: float | None = None
    """0..1 of its capacity (`percentage` in ROS)."""
    temperature_c: float | None = None
    """°C"""
    status: str = "unknown"
    """`unknown`, `charging`, `discharging`, `not-charging` or `full`."""

    def faults(self) -> Iterator[str]:
        """A fraction outside 0..1, amounts below nothing, an unknown status."""
        if self.fraction is not None and not 0 <= self.fraction <= 1:
            yield f"fraction {self.fraction} is not within 0..1"
        for name in ("voltage_v", "charge_ah", "capacity_ah"):
            amount = getattr(self, name)
            if amount is not None and amount < 0:
                yield f"{name} {amount} is negative"
        if self.status not in self.STATUS:
            yield f"status {self.status!r} is none of {', '.join(self.STATUS)}"


def _covariance_faults(name: str, values: Covariance | None) -> Iterator[str]:
    if values is not None and min(values[0], values[4], values[8]) < 0:
        yield f"{name} has a negative number on its diagonal"

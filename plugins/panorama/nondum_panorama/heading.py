"""Which way the body faces, relative to when a stream began."""

from __future__ import annotations

import math

from nondum.sdk import Pose

_EXTRAPOLATE_S = 0.2


class BodyHeading:
    """The heading by odometry, radians to the left of where the body faced at first, unwrapped.

    Without odometry the body is taken to stand still.
    """

    def __init__(self) -> None:
        self._newest: Pose | None = None
        self._turned = 0.0

    def update(self, pose: Pose) -> None:
        """Take in what odometry says; the first pose becomes the direction that angles count
        from, a pose seen before changes nothing."""
        if self._newest is not None:
            self._turned += math.remainder(pose.yaw_rad - self._newest.yaw_rad, math.tau)
        self._newest = pose

    def at(self, stamp_s: float) -> float:
        """The heading at a time soon after the newest pose, turning on as that one said."""
        pose = self._newest
        if pose is None or pose.twist is None:
            return self._turned
        age = min(max(stamp_s - pose.header.stamp_s, 0.0), _EXTRAPOLATE_S)
        return self._turned + pose.twist.angular[2] * age

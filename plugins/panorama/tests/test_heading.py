"""The body's heading by odometry."""

from __future__ import annotations

import math

import pytest

from nondum.sdk import Header, Pose, Twist
from nondum_panorama.heading import BodyHeading


def pose(yaw: float, stamp_s: float = 0.0, rate: float | None = None) -> Pose:
    header = Header(stamp_s=stamp_s, frame_id="robot/odom")
    twist = None if rate is None else Twist(Header(frame_id="robot"), angular=(0.0, 0.0, rate))
    turned = (0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))
    return Pose(header, (0.0, 0.0, 0.0), turned, "robot", twist)


def test_without_odometry_the_body_stands_still() -> None:
    assert BodyHeading().at(5.0) == 0.0


def test_first_pose_is_where_angles_count_from() -> None:
    heading = BodyHeading()
    heading.update(pose(2.0))
    assert heading.at(0.0) == 0.0
    heading.update(pose(2.5))
    assert heading.at(0.0) == pytest.approx(0.5)


def test_heading_does_not_wrap() -> None:
    heading = BodyHeading()
    for step in range(30):
        heading.update(pose(0.5 * step))
    assert heading.at(0.0) == pytest.approx(14.5)


def test_turning_goes_on_for_a_moment_only() -> None:
    heading = BodyHeading()
    heading.update(pose(0.0, stamp_s=10.0, rate=0.5))
    assert heading.at(10.1) == pytest.approx(0.05)
    assert heading.at(15.0) == pytest.approx(0.1)

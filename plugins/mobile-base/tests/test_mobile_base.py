"""The base on the bench."""

from __future__ import annotations

import math
import time
from typing import Any

import pytest

from nondum.sdk import Header, Pose, Twist, WorkerFailed

PLUGIN = "nondum_mobile_base.plugin:MobileBase"


def drive(bench: Any) -> Any:
    return bench.behave("drive", u="base", s="steering", h=bench.host, c="person")


def twist(turn: float, frame: str = "robot", age_s: float = 0.0, speed: float = 0.0) -> Twist:
    header = Header(stamp_s=time.monotonic() - age_s, frame_id=frame)
    return Twist(header, linear=(speed, 0.0, 0.0), angular=(0.0, 0.0, turn))


def turn_of(pose: Pose) -> float:
    assert pose.twist is not None
    return pose.twist.angular[2]


def until(bench: Any, is_so: Any, feed: Twist | None = None) -> Pose:
    """The first odometry that satisfies, with a command fed again for each that does not."""
    for _ in range(600):
        pose: Pose = bench.read("odometry")
        if is_so(pose):
            return pose
        if feed:
            bench.feed(twist(feed.angular[2], feed.header.frame_id), stream="steering")
    raise AssertionError("never")


def test_odometry_flows_before_anything_drives(worker: Any) -> None:
    bench = worker(PLUGIN, settings={"start_heading_deg": 30})
    pose: Pose = bench.read("odometry")
    assert math.degrees(pose.yaw_rad) == pytest.approx(30)
    assert (pose.header.frame_id, pose.child_frame_id) == ("robot/odom", "robot")


def test_base_obeys_and_brakes_when_the_stream_falls_silent(worker: Any) -> None:
    bench = worker(PLUGIN)
    call = drive(bench)
    bench.feed(twist(0.5), stream="steering")
    call.wait_established()
    until(bench, lambda pose: turn_of(pose) == 0.5, feed=twist(0.5))
    until(bench, lambda pose: turn_of(pose) == 0.0)
    assert call.state == "established"


def test_halted_base_brakes(worker: Any) -> None:
    bench = worker(PLUGIN)
    call = drive(bench)
    bench.feed(twist(0.5), stream="steering")
    call.wait_established().halt()
    bench.drain("odometry")
    until(bench, lambda pose: turn_of(pose) == 0.0)


def test_command_that_was_long_under_way_is_not_obeyed(worker: Any) -> None:
    bench = worker(PLUGIN)
    call = drive(bench)
    bench.feed(twist(0.5, age_s=1.0), stream="steering")
    call.wait_established()
    bench.drain("odometry")
    assert all(turn_of(bench.read("odometry")) == 0.0 for _ in range(4))


def test_command_in_an_unknown_frame_fails(worker: Any) -> None:
    bench = worker(PLUGIN)
    call = drive(bench)
    bench.feed(twist(0.5, frame="elsewhere"), stream="steering")
    assert call.wait().state == "failed"


def test_wrong_settings_refuse_the_component(worker: Any) -> None:
    with pytest.raises(WorkerFailed, match="deadline_s"):
        worker(PLUGIN, settings={"deadline_s": 0})

"""The tracker on the bench."""

from __future__ import annotations

import math
import time
from typing import Any

import pytest

from nondum.sdk import (
    BoundingBox2D,
    CameraModel,
    Detection,
    Detections,
    Header,
    Twist,
    WorkerFailed,
)

PLUGIN = "nondum_visual_tracker.plugin"
EYE = "robot__cam__eye"
CAMERA = CameraModel(640, 480, 500.0, 500.0, 320.0, 240.0)
AHEAD = {EYE: ((0.0, 0.0, 0.4), (0.0, 0.0, 0.0))}
PATIENT = {"coast_s": 60.0, "stop_s": 60.0}
"""The tracker forgets no person between two images, however slow the machine is."""


def person(azimuth: float) -> Detections:
    column = 320 - 500 * math.tan(azimuth)
    found = Detection("person", 0.9, BoundingBox2D(column, 240, 60, 170))
    return Detections(Header(frame_id=EYE), (found,), 640, 480, CAMERA)


def empty_view() -> Detections:
    return Detections(Header(frame_id=EYE), (), 640, 480, CAMERA)


def track(bench: Any) -> Any:
    return bench.behave("track", u="tracker", d="people", o="steering", h=bench.host, c="person")


def shown(bench: Any, azimuth: float, call: Any) -> Any:
    """Feed images until the behaviour is established or over."""
    for _ in range(40):
        if call.state != "running":
            break
        bench.feed(person(azimuth), stream="people")
        bench.wait_until(lambda: bool(bench.drain("steering")) or call.has_ended, "steering")
    return call


@pytest.mark.parametrize("azimuth", [-0.3, 0.3])
def test_body_is_turned_towards_the_person(worker: Any, azimuth: float) -> None:
    bench = worker(PLUGIN, mounts=AHEAD, settings=PATIENT)
    call = shown(bench, azimuth, track(bench)).wait_established()
    bench.drain("steering")
    twist: Twist = bench.read("steering")
    assert twist.header.frame_id == bench.host
    assert math.copysign(1, twist.angular[2]) == math.copysign(1, azimuth)
    assert abs(twist.angular[2]) > 0.2
    assert call.halt().state == "halted"


def test_nothing_moves_and_nothing_is_claimed_before_somebody_is_seen(worker: Any) -> None:
    bench = worker(PLUGIN, mounts=AHEAD)
    call = track(bench)
    bench.feed(empty_view(), stream="people")
    assert all(bench.read("steering").angular == (0.0, 0.0, 0.0) for _ in range(5))
    assert call.state == "running"


def test_mount_of_the_camera_counts(worker: Any) -> None:
    """A camera that looks to the left sees somebody ahead of it: they are at the body's left."""
    ahead = {EYE: ((0.0, 0.0, 0.4), (0.0, 0.0, math.pi / 2))}
    bench = worker(PLUGIN, mounts=ahead, settings=PATIENT)
    shown(bench, 0.0, track(bench)).wait_established()
    bench.drain("steering")
    assert bench.read("steering").angular[2] > 0.5


def test_body_of_another_host_is_not_taken_for_the_own(worker: Any) -> None:
    """On a compute node: the camera's place on the robot counts, wherever the tracker runs."""
    bench = worker(PLUGIN, mounts=AHEAD)
    call = bench.behave("track", u="tracker", d="people", o="steering", h="rover", c="person")
    bench.drain("steering")
    assert bench.read("steering").header.frame_id == "rover"
    shown(bench, 0.3, call).assert_failed("FRAME_UNKNOWN")


def test_unknown_mount_fails(worker: Any) -> None:
    bench = worker(PLUGIN)
    assert shown(bench, 0.0, track(bench)).wait().state == "failed"


def test_track_fails_when_no_one_is_in_sight_for_long(worker: Any) -> None:
    bench = worker(PLUGIN, mounts=AHEAD, settings={"give_up_s": 0.2})
    track(bench).assert_failed("TARGET_LOST")


def test_watch_succeeds_when_somebody_is_seen_for_certain(worker: Any) -> None:
    bench = worker(PLUGIN, mounts=AHEAD, settings=PATIENT)
    call = bench.behave("watch", u="tracker", d="people", h=bench.host, c="person")
    ends_s = time.monotonic() + 60
    while not call.has_ended and time.monotonic() < ends_s:
        bench.feed(person(0.1), stream="people")
        time.sleep(0.05)  # the rate of a camera
    call.assert_succeeded()


def test_watch_fails_when_no_one_comes(worker: Any) -> None:
    bench = worker(PLUGIN, mounts=AHEAD, settings={"give_up_s": 0.2})
    call = bench.behave("watch", u="tracker", d="people", h=bench.host, c="person")
    call.assert_failed("TARGET_LOST")


@pytest.mark.parametrize("settings", [{"person_m": 0}, {"coast_s": 4}], ids=str)
def test_wrong_settings_refuse_the_component(worker: Any, settings: dict[str, object]) -> None:
    with pytest.raises(WorkerFailed, match="SETTING_INVALID"):
        worker(PLUGIN, settings=settings)

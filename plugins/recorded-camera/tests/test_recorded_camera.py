"""The recorded camera on the bench."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from nondum.sdk import Header, Image, Pose, WorkerFailed

PLUGIN = "nondum_recorded_camera.plugin"


def pose(yaw: float) -> Pose:
    turned = (0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))
    return Pose(Header(frame_id="robot/odom"), (0.0, 0.0, 0.0), turned, "robot")


def stream(bench: Any) -> Any:
    return bench.behave("stream", u="camera", o="image", h=bench.host)


def numbers(bench: Any, count: int) -> list[int]:
    return [bench.read("image").header.seq for _ in range(count)]


def test_images_carry_stamp_frame_and_model(worker: Any) -> None:
    bench = worker(PLUGIN)
    call = stream(bench).wait_established()
    image: Image = bench.read("image")
    assert (image.width, image.height, image.encoding) == (480, 320, "bgr8")
    assert image.header.frame_id == bench.objects["camera"]
    assert image.camera is not None
    assert 2 * math.degrees(math.atan(image.width / 2 / image.camera.fx)) == pytest.approx(70)
    assert call.halt().state == "halted"


def test_reading_the_recording_is_told_as_progress(worker: Any) -> None:
    bench = worker(PLUGIN)
    call = stream(bench).wait_established()
    done = [fraction for fraction, _ in call.progress]
    assert done and done == sorted(done)


def test_first_frame_stands_still_then_the_clip_runs(worker: Any) -> None:
    bench = worker(PLUGIN, settings={"hold_s": 0.3, "pace": "every-frame"})
    stream(bench)
    assert numbers(bench, 7) == [19, 19, 19, 19, 20, 21, 22]


def test_view_pans_with_the_body(worker: Any) -> None:
    bench = worker(PLUGIN, settings={"hold_s": 60.0})
    bench.feed(pose(1.0), slot="odometry", unit="camera")
    stream(bench).wait_established()
    before = bench.read("image").array().copy()
    bench.feed(pose(1.0 + math.radians(5)), slot="odometry", unit="camera")
    bench.drain("image")
    bench.read("image")
    after = bench.read("image").array()
    focal = 240 / math.tan(math.radians(35))
    shift = round(focal * math.tan(math.radians(5)))
    middle = slice(200, 280)
    moved = abs(after[100:220, 200 + shift : 280 + shift].astype(int) - before[100:220, middle])
    still = abs(after[100:220, middle].astype(int) - before[100:220, middle])
    assert moved.mean() < still.mean() / 2


def test_wrong_settings_refuse_the_component(worker: Any) -> None:
    with pytest.raises(WorkerFailed, match="there is no setting 'witdh'"):
        worker(PLUGIN, settings={"witdh": 3})


def test_missing_recording_fails_the_behaviour(worker: Any, tmp_path: Path) -> None:
    notes = tmp_path / "x.toml"
    notes.write_text('video = "x.avi"\nwidth = 100', encoding="utf-8")
    bench = worker(PLUGIN, settings={"clip": str(notes)})
    stream(bench).assert_failed("RECORDING_UNREADABLE")


def test_device_that_is_no_camera_fails_the_behaviour(worker: Any) -> None:
    bench = worker(PLUGIN, devices={"camera": "/dev/null"})
    stream(bench).assert_failed("CAMERA_FAILED")

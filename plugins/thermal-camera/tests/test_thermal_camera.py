"""The thermal camera on the bench."""

from __future__ import annotations

from typing import Any

import pytest

from nondum.sdk import Image, WorkerFailed

PLUGIN = "nondum_thermal_camera.plugin"


def test_simulated_images_are_grey(worker: Any) -> None:
    bench = worker(PLUGIN, settings={"width": 320, "height": 240})
    call = bench.behave("stream", u="thermal-eye", o="warmth", h=bench.host).wait_established()
    image: Image = bench.read("warmth")
    assert (image.width, image.height, image.encoding) == (320, 240, "mono8")
    assert image.header.frame_id == bench.objects["thermal-eye"]
    assert image.camera is not None
    assert call.halt().state == "halted"


def test_reading_the_recording_is_told_as_progress(worker: Any) -> None:
    bench = worker(PLUGIN)
    call = bench.behave("stream", u="thermal-eye", o="warmth", h=bench.host).wait_established()
    done = [fraction for fraction, _ in call.progress]
    assert done and done == sorted(done)


def test_device_that_is_no_camera_fails_the_behaviour(worker: Any) -> None:
    bench = worker(PLUGIN, devices={"camera": "/dev/null"})
    call = bench.behave("stream", u="thermal-eye", o="warmth", h=bench.host)
    call.assert_failed("CAMERA_FAILED")


def test_wrong_settings_refuse_the_component(worker: Any) -> None:
    with pytest.raises(WorkerFailed, match="cannot see 200"):
        worker(PLUGIN, settings={"field_of_view_deg": 200})


def test_summary_says_that_it_simulates(worker: Any) -> None:
    assert "Simulates" in worker(PLUGIN).description.summary

"""The detector on the bench, with real people."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from nondum.sdk import CameraModel, Detections, Header, Image, WorkerFailed

PLUGIN = "nondum_people_detector.plugin"
CAMERA = CameraModel(320, 360, 300.0, 300.0, 160.0, 180.0)
WALKER = (158.0, 125.0)
"""The middle of the person in the picture, read off by eye."""


@pytest.fixture(scope="module")
def walker() -> np.ndarray[Any, np.dtype[np.uint8]]:
    """One person walking, cut out of the packaged recording's frame 60."""
    data = Path(__file__).parents[2] / "panorama" / "nondum_panorama" / "data" / "pedestrians.avi"
    capture = cv2.VideoCapture(str(data))
    try:
        for _ in range(61):
            is_there, frame = capture.read()
            assert is_there
    finally:
        capture.release()
    return np.asarray(frame[180:540, 470:768], dtype=np.uint8)


def message(array: np.ndarray[Any, Any], encoding: str = "bgr8") -> Image:
    header = Header(stamp_s=12.5, frame_id="robot__cam__camera", seq=7)
    return Image.from_array(header, array, encoding, CAMERA)


def detect(bench: Any, image: Image) -> tuple[Any, Detections]:
    call = bench.behave("detect", u="detector", i="images", o="people", h=bench.host, c="person")
    bench.feed(image, stream="images")
    return call.wait_established(), bench.read("people")


def test_person_is_found_where_they_are(
    worker: Any, walker: np.ndarray[Any, np.dtype[np.uint8]]
) -> None:
    _, seen = detect(worker(PLUGIN), message(walker))
    middles = [(one.box.cx, one.box.cy) for one in seen.detections]
    assert any(abs(x - WALKER[0]) < 15 and abs(y - WALKER[1]) < 20 for x, y in middles)
    assert {one.class_id for one in seen.detections} == {"person"}


def test_detections_keep_stamp_frame_and_camera(
    worker: Any, walker: np.ndarray[Any, np.dtype[np.uint8]]
) -> None:
    image = message(walker)
    call, seen = detect(worker(PLUGIN), image)
    assert (seen.header, seen.camera) == (image.header, CAMERA)
    assert (seen.image_width, seen.image_height) == (walker.shape[1], walker.shape[0])
    assert call.halt().state == "halted"


@pytest.mark.parametrize("encoding", ["rgb8", "mono8", "mono16"])
def test_any_encoding_serves(
    worker: Any, walker: np.ndarray[Any, np.dtype[np.uint8]], encoding: str
) -> None:
    grey = np.asarray(cv2.cvtColor(walker, cv2.COLOR_BGR2GRAY))
    # A thermal camera's: a small part of 16 bits.
    deep = (grey.astype(np.uint16) * 4 + 7000).astype(np.uint16)
    array = {"rgb8": walker[:, :, ::-1], "mono8": grey, "mono16": deep}[encoding]
    _, seen = detect(worker(PLUGIN), message(array, encoding))
    assert any(abs(one.box.cx - WALKER[0]) < 15 for one in seen.detections)


def test_no_person_is_found_in_noise(worker: Any) -> None:
    noise = np.random.default_rng(1).integers(0, 255, (360, 320, 3)).astype(np.uint8)
    _, seen = detect(worker(PLUGIN), message(noise))
    assert seen.detections == ()


def test_image_smaller_than_a_person_is_empty(worker: Any) -> None:
    _, seen = detect(worker(PLUGIN), message(np.zeros((40, 40, 3), dtype=np.uint8)))
    assert seen.detections == ()


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"scale": 1.0}, "scale is 1.0"),
        ({"weights_layout": "v4"}, "one of 'v8', 'v5'"),
        ({"weights": "/no/such.onnx"}, "weights"),
    ],
    ids=["scale", "layout", "weights are data, no setting"],
)
def test_wrong_settings_refuse_the_component(
    worker: Any, settings: dict[str, object], words: str
) -> None:
    with pytest.raises(WorkerFailed, match=words):
        worker(PLUGIN, settings=settings)

"""The detector on the bench, and how well it does against the reference track."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from nondum.sdk import Detections, Header, Image, WorkerFailed
from nondum_panorama.clip import packaged_clip, read_reference
from nondum_panorama.streaming import camera_model, open_recording
from nondum_panorama.view import Lens, View
from nondum_pedestrian_detector.settings import Settings
from nondum_pedestrian_detector.spotter import Spotter

PLUGIN = "nondum_pedestrian_detector.plugin"
CLIP = packaged_clip()
VIEW = View()
NEAR_PX = 15
ENCODINGS = {2: "mono8", 3: "bgr8"}

Shown = tuple[Image, float]
"""An image, and the column that the reference person is at in it."""


def message(array: np.ndarray[Any, Any], encoding: str = "") -> Image:
    header = Header(stamp_s=12.5, frame_id="robot__cam__camera", seq=7)
    model = camera_model(VIEW) if array.shape[:2] == (VIEW.height, VIEW.width) else None
    return Image.from_array(header, array, encoding or ENCODINGS[array.ndim], model)


@pytest.fixture(scope="module")
def shown() -> list[Shown]:
    """Every fourth frame, looked at with the reference person ahead and to both sides."""
    return list(_shown())


def _shown() -> Iterator[Shown]:
    assert CLIP.reference is not None
    recording, lens = open_recording(CLIP), Lens(CLIP, VIEW)
    for number, column in list(read_reference(CLIP.reference).items())[::4]:
        for aside in (math.radians(-15), 0.0, math.radians(15)):
            seen = lens.look(recording.frame(number), CLIP.azimuth(column) + aside)
            yield message(seen), VIEW.centre[0] + VIEW.focal_px * math.tan(aside)


def near(seen: Detections, column: float) -> int:
    """How many detections are where the reference person is."""
    return sum(abs(one.box.cx - column) < NEAR_PX for one in seen.detections)


def spot(bench: Any, image: Image) -> tuple[Any, Detections]:
    arguments = {"u": "spotter", "i": "images", "o": "pedestrians", "h": bench.host}
    call = bench.behave("spot", **arguments, c="person")
    bench.feed(image, stream="images")
    return call.wait_established(), bench.read("pedestrians")


def test_reference_person_is_found_in_nearly_every_view(shown: list[Shown]) -> None:
    spotter = Spotter(Settings())
    found = [near(spotter.spot(image, "person"), column) for image, column in shown]
    assert len(found) == 30
    assert sum(map(bool, found)) >= 28


def test_one_person_is_hardly_ever_told_twice(shown: list[Shown]) -> None:
    spotter = Spotter(Settings())
    found = [near(spotter.spot(image, "person"), column) for image, column in shown]
    assert sum(number > 1 for number in found) <= 3


def test_detections_keep_stamp_frame_and_camera(worker: Any, shown: list[Shown]) -> None:
    image, column = shown[12]
    call, seen = spot(worker(PLUGIN), image)
    assert near(seen, column) == 1
    assert (seen.header, seen.camera) == (image.header, image.camera)
    assert (seen.image_width, seen.image_height) == (VIEW.width, VIEW.height)
    assert {one.class_id for one in seen.detections} == {"person"}
    scores = [one.score for one in seen.detections]
    assert scores == sorted(scores, reverse=True)
    assert call.halt().state == "halted"


@pytest.mark.parametrize("encoding", ["rgb8", "mono8", "mono16"])
def test_any_encoding_serves(shown: list[Shown], encoding: str) -> None:
    image, column = shown[12]
    colour = np.asarray(image.array())
    grey = colour.mean(axis=2)
    array = {
        "rgb8": colour[:, :, ::-1],
        "mono8": grey.astype(np.uint8),
        "mono16": (grey * 4 + 7000).astype(np.uint16),  # a thermal camera's part of 16 bits
    }[encoding]
    assert near(Spotter(Settings()).spot(message(array, encoding), "person"), column)


def test_no_person_is_found_in_noise() -> None:
    noise = np.random.default_rng(1).integers(0, 255, (320, 480, 3)).astype(np.uint8)
    assert Spotter(Settings()).spot(message(noise), "person").detections == ()


def test_image_smaller_than_a_person_is_empty() -> None:
    small = message(np.zeros((90, 40, 3), dtype=np.uint8))
    assert Spotter(Settings()).spot(small, "person").detections == ()


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"scale": 1.0}, "scale is 1.0"),
        ({"overlap": 1.0}, "overlap is 1.0"),
        ({"threshold": 0.0}, "threshold is 0.0"),
        ({"threads": 0}, "threads is 0"),
    ],
    ids=["scale", "overlap", "threshold", "threads"],
)
def test_wrong_settings_refuse_the_component(
    worker: Any, settings: dict[str, object], words: str
) -> None:
    with pytest.raises(WorkerFailed, match=words):
        worker(PLUGIN, settings=settings)

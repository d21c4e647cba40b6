"""From boxes to angles and distances."""

from __future__ import annotations

import math
import struct

import pytest

from nondum.sdk import Bearing, BoundingBox2D, CameraModel, Depth, Detection, Detections, Header
from nondum_visual_tracker.eye import sightings
from nondum_visual_tracker.sighting import Sighting

CAMERA = CameraModel(640, 480, 500.0, 500.0, 320.0, 240.0)
HEADER = Header(stamp_s=5.0, frame_id="eye")


def seen(
    *boxes: BoundingBox2D, camera: CameraModel | None = CAMERA, kind: str = "person"
) -> Detections:
    found = tuple(Detection(kind, 0.9, box) for box in boxes)
    return Detections(HEADER, found, 640, 480, camera)


def look(detections: Detections, depth: Depth | None = None) -> tuple[Sighting, ...]:
    def level(bearing: Bearing) -> Bearing:
        return bearing

    return sightings(detections, "person", to_body=level, field_of_view_deg=60.0, depth=depth)


def depth(
    metres: float, *, encoding: str = "16UC1", stamp_s: float = 5.0, frame: str = "eye"
) -> Depth:
    """A plane at one distance, with a hole in every other column."""
    code = "H" if encoding == "16UC1" else "f"
    value = round(metres * 1000) if encoding == "16UC1" else metres
    row = [value if x % 2 else 0 for x in range(160)]
    data = struct.pack(f"<{160 * 120}{code}", *(row * 120))
    step = len(data) // 120
    return Depth(Header(stamp_s=stamp_s, frame_id=frame), 120, 160, encoding, step, data, None)


def test_box_on_the_left_is_at_positive_azimuth() -> None:
    (sighting,) = look(seen(BoundingBox2D(320 - 500 * math.tan(0.3), 240, 40, 100)))
    assert sighting.azimuth == pytest.approx(0.3)


def test_apparent_height_spans_the_box() -> None:
    (sighting,) = look(seen(BoundingBox2D(320, 240, 40, 100)))
    assert sighting.height == pytest.approx(2 * math.atan(50 / 500))


def test_mount_turns_the_bearing() -> None:
    def turned(bearing: Bearing) -> Bearing:
        x, y, z = bearing.direction
        return Bearing(bearing.header, (-y, x, z), bearing.sigma_rad)

    found = sightings(
        seen(BoundingBox2D(320, 240, 40, 100)), "person", to_body=turned, field_of_view_deg=60.0
    )
    assert found[0].azimuth == pytest.approx(math.pi / 2)


def test_without_a_camera_model_one_is_assumed() -> None:
    (sighting,) = look(seen(BoundingBox2D(0, 240, 40, 100), camera=None))
    assert math.degrees(sighting.azimuth) == pytest.approx(30, abs=0.1)


def test_other_classes_are_not_seen() -> None:
    assert look(seen(BoundingBox2D(320, 240, 40, 100), kind="goose")) == ()


@pytest.mark.parametrize("encoding", ["16UC1", "32FC1"])
def test_depth_gives_the_range(encoding: str) -> None:
    (sighting,) = look(seen(BoundingBox2D(322, 240, 90, 200)), depth(3.25, encoding=encoding))
    assert sighting.range_m == pytest.approx(3.25)


@pytest.mark.parametrize(
    "other", [depth(3.0, stamp_s=4.0), depth(3.0, frame="other"), depth(0.0)],
    ids=["old", "of another camera", "without distances"],
)  # fmt: skip
def test_depth_that_tells_nothing_is_left_out(other: Depth) -> None:
    (sighting,) = look(seen(BoundingBox2D(322, 240, 90, 200)), other)
    assert sighting.range_m is None


def test_box_beyond_the_edge_has_no_range() -> None:
    (sighting,) = look(seen(BoundingBox2D(-200, 240, 90, 200)), depth(3.0))
    assert sighting.range_m is None

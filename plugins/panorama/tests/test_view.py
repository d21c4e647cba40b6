"""Views: a pinhole camera in a cylinder."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from nondum_panorama.clip import stated
from nondum_panorama.view import Lens, View

CLIP = stated(Path("x.avi"), width=900, height=300, field_of_view_deg=90.0)
VIEW = View(width=201, height=101, field_of_view_deg=40.0)


def panorama(column: int) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    frame = np.zeros((CLIP.height, CLIP.width), dtype=np.uint8)
    frame[:, column - 1 : column + 2] = 255
    return frame


@pytest.mark.parametrize("offset_deg", [-15.0, -5.0, 0.0, 5.0, 15.0])
def test_pinhole_model_gives_the_azimuth_back(offset_deg: float) -> None:
    """A line in the panorama is seen where the camera model says that its azimuth is."""
    heading = math.radians(10)
    azimuth = heading + math.radians(offset_deg)
    column = round(CLIP.column(azimuth))
    seen = Lens(CLIP, VIEW).look(panorama(column), heading)
    cx, cy = VIEW.centre
    place = float(np.average(np.arange(VIEW.width), weights=seen[round(cy)]))
    found = heading + math.atan((cx - place) / VIEW.focal_px)
    assert found == pytest.approx(CLIP.azimuth(column), abs=math.radians(0.2))


def test_turning_left_moves_things_right() -> None:
    lens, frame = Lens(CLIP, VIEW), panorama(450)
    before, after = (int(lens.look(frame, a)[50].argmax()) for a in (0.0, math.radians(5)))
    assert after > before


def test_horizon_stays_a_level_line() -> None:
    frame = np.zeros((CLIP.height, CLIP.width), dtype=np.uint8)
    frame[149:152] = 255
    rows = Lens(CLIP, VIEW).look(frame, 0.3).argmax(axis=0)
    assert np.ptp(rows) <= 1


def test_beyond_the_edges_it_is_grey() -> None:
    seen = Lens(CLIP, VIEW).look(panorama(450), math.radians(170))
    assert np.unique(seen).tolist() == [100]


def test_colour_stays_colour() -> None:
    frame = np.dstack([panorama(450)] * 3)
    assert Lens(CLIP, VIEW).look(frame, 0.0).shape == (101, 201, 3)


@pytest.mark.parametrize("view", [(480, 320, 0.0), (480, 320, 170.0), (8, 320, 60.0)], ids=str)
def test_impossible_view_is_refused(view: tuple[int, int, float]) -> None:
    with pytest.raises(ValueError, match=r"cannot see|too small"):
        View(*view)

"""Clips: what is stated about a recording."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import pytest

from nondum_panorama.clip import packaged_clip, read_clip, read_reference, stated


def test_packaged_clip_is_whole() -> None:
    clip = packaged_clip()
    assert clip.video.exists()
    assert clip.reference is not None
    assert set(read_reference(clip.reference)) == set(range(clip.first, clip.last + 1))


def test_reference_person_crosses_more_than_a_tolerance() -> None:
    clip = packaged_clip()
    assert clip.reference is not None
    azimuths = [clip.azimuth(column) for column in read_reference(clip.reference).values()]
    assert max(azimuths) - min(azimuths) > math.radians(35)
    steps = [abs(b - a) * clip.frames_per_s for a, b in pairwise(azimuths)]
    assert max(steps) < math.radians(15)


def test_reference_person_is_off_to_the_side_at_the_start() -> None:
    clip = packaged_clip()
    assert clip.reference is not None
    start = clip.azimuth(read_reference(clip.reference)[clip.first])
    assert math.radians(10) < -start < math.radians(20)


def test_column_and_azimuth_are_inverse() -> None:
    clip = stated(Path("x.avi"), width=800, field_of_view_deg=100.0, ahead_column=300.0)
    assert clip.column(clip.azimuth(123.0)) == pytest.approx(123.0)
    assert clip.azimuth(0.0) > 0 > clip.azimuth(799.0)


@pytest.mark.parametrize(
    "notes",
    [
        'video = "x.avi"\nwidth = 100\nfirst = 3\nlast = 2',
        'video = "x.avi"\nwidth = 100\nfield_of_view_deg = 0',
        'video = "x.avi"\nwidth = 100\nwitdh = 100',
    ],
    ids=["stretch", "field of view", "unknown key"],
)
def test_impossible_notes_are_refused(tmp_path: Path, notes: str) -> None:
    path = tmp_path / "x.toml"
    path.write_text(notes, encoding="utf-8")
    with pytest.raises(ValueError, match=r"cannot|unknown"):
        read_clip(path)


def test_paths_are_beside_the_notes(tmp_path: Path) -> None:
    path = tmp_path / "x.toml"
    path.write_text('video = "x.avi"\nreference = "x.csv"\nwidth = 100', encoding="utf-8")
    clip = read_clip(path)
    assert (clip.video, clip.reference) == (tmp_path / "x.avi", tmp_path / "x.csv")

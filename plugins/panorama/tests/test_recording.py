"""Recordings: any frame at any time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from nondum_panorama.clip import packaged_clip
from nondum_panorama.recording import Recording, frames_of


def test_frames_come_back_as_they_were() -> None:
    clip = packaged_clip()
    recording = Recording.open(clip.video, 3, 5)
    original = list(frames_of(clip.video, stop=6))[5]
    difference = np.abs(recording.frame(5).astype(int) - original.astype(int))
    assert recording.frame(5).shape == (clip.height, clip.width, 3)
    assert difference.mean() < 2


def test_frames_outside_the_stretch_are_not_there() -> None:
    recording = Recording.open(packaged_clip().video, 3, 4)
    with pytest.raises(KeyError):
        recording.frame(2)


def test_stretch_beyond_the_end_is_refused() -> None:
    with pytest.raises(OSError, match="140 to 160 are wanted, 10 are there"):
        Recording.open(packaged_clip().video, 140, 160)


def test_reading_tells_how_far_it_is_and_ends_where_that_raises() -> None:
    told: list[float] = []
    Recording.open(packaged_clip().video, 3, 4, told.append)
    assert told == [0.2, 0.4, 0.6, 0.8, 1.0]
    with pytest.raises(ZeroDivisionError):
        Recording.open(packaged_clip().video, 3, 4, lambda done: 1 // 0)


def test_file_that_is_no_video_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.avi"
    path.write_bytes(b"no video")
    with pytest.raises(OSError, match="not a video"):
        list(frames_of(path))

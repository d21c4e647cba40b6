"""A stretch of video in memory, any frame at any time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

Frame = npt.NDArray[np.uint8]
Tell = Callable[[float], None]
"""A callback for progress: called after each frame with the fraction that is done, 0 to 1. An
exception that it raises ends the reading."""


def not_told(_done: float) -> None:
    """The `Tell` that does nothing."""


_JPEG_QUALITY = 95


class Recording:
    """The frames `first` to `last` of a video, kept as JPEG.

    Video codecs play forwards only, and decoded frames of a few seconds fill 60 MB; JPEG at
    quality 95 costs about 0.1 MB a frame and 3 ms to decode.
    """

    def __init__(self, frames: dict[int, npt.NDArray[np.uint8]]) -> None:
        self._frames = frames

    @classmethod
    def open(cls, video: Path, first: int, last: int, tell: Tell = not_told) -> Recording:
        """Read the stretch. Raises `OSError` when the video does not hold it."""
        frames = {}
        for number, frame in enumerate(frames_of(video, stop=last + 1)):
            if number >= first:
                frames[number] = _packed(frame)
            tell((number + 1) / (last + 1))
        if len(frames) != last - first + 1:
            raise OSError(f"{video}: frames {first} to {last} are wanted, {len(frames)} are there")
        return cls(frames)

    def frame(self, number: int) -> Frame:
        """The frame of that number, height × width × 3, blue-green-red. Raises `KeyError`."""
        return _pixels(cv2.imdecode(self._frames[number], cv2.IMREAD_COLOR))


def frames_of(video: Path, *, stop: int | None = None) -> Iterator[Frame]:
    """Decode a video from its beginning. Raises `OSError` when it cannot be opened."""
    capture = cv2.VideoCapture(str(video), cv2.CAP_FFMPEG)
    if not capture.isOpened():
        raise OSError(f"{video}: not a video that can be read")
    try:
        number = 0
        while stop is None or number < stop:
            is_there, frame = capture.read()
            if not is_there:
                return
            yield _pixels(frame)
            number += 1
    finally:
        capture.release()


def _packed(frame: Frame) -> npt.NDArray[np.uint8]:
    is_done, packed = cv2.imencode(".jpg", frame, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])
    if not is_done:
        raise OSError("a frame could not be packed as JPEG")
    return _pixels(packed)


def _pixels(array: Any) -> npt.NDArray[np.uint8]:
    return np.asarray(array, dtype=np.uint8)

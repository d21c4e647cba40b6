"""A real camera, by Video4Linux."""

from __future__ import annotations

import cv2
import numpy as np

from nondum_panorama.recording import Frame


class Capture:
    """An opened V4L2 device; close it."""

    def __init__(self, node: str) -> None:
        """Raises `OSError` when `node` is no camera, or is busy."""
        self._capture = cv2.VideoCapture(node, cv2.CAP_V4L2)
        if not self._capture.isOpened():
            self._capture.release()
            raise OSError(f"{node}: not a camera that can be opened")
        # A driver's queue of four makes images old before they are seen.
        self._capture.set(cv2.CAP_PROP_BUFFERSIZE, 1)

    def read(self) -> Frame | None:
        """Wait for the next image, height × width × 3; None when the camera gives no more."""
        is_there, frame = self._capture.read()
        return np.asarray(frame, dtype=np.uint8) if is_there else None

    def close(self) -> None:
        """Let the device go."""
        self._capture.release()

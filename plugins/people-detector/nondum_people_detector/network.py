"""People by a YOLO-class network in ONNX, run by OpenCV's own inference on the CPU.

The weights are the operator's: none are shipped, as their licences differ. Understood are exports
with one output of raw predictions: `v8` (1 × (4 + classes) × N, also v9 and v11) and `v5`
(1 × N × (5 + classes), also v7, with an objectness).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import cv2
import numpy as np
import numpy.typing as npt

from nondum.sdk.errors import ConfigRefused, Problem
from nondum_people_detector.boxes import Found, merged

Layout = Literal["v8", "v5"]
_GREY = 114


class NetworkDetector:
    """Finds one class of a network's."""

    def __init__(
        self, weights: Path, *, size: int, layout: Layout, number: int, threshold: float,
        overlap: float,
    ) -> None:  # fmt: skip
        """`size`: side of the square input in pixels; `number`: the class's place in the output.

        Raises `ConfigRefused` (WEIGHTS_UNREADABLE).
        """
        self._size = size
        self._layout = layout
        self._number = number
        self._threshold = threshold
        self._overlap = overlap
        try:
            self._network: Any = cv2.dnn.readNetFromONNX(str(weights))
        except cv2.error as error:
            fix = "export the network to ONNX with one output, and put that on the drive"
            raise ConfigRefused(
                Problem("WEIGHTS_UNREADABLE", str(error), where=str(weights), fix=fix)
            ) from error

    def find(self, image: npt.NDArray[np.uint8]) -> tuple[Found, ...]:
        """Things in a grey or blue-green-red image, best first."""
        if image.ndim == 2:
            image = np.asarray(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR), dtype=np.uint8)
        factor = self._size / max(image.shape[:2])
        self._network.setInput(self._blob(image, factor))
        rows = self._rows(np.asarray(self._network.forward(), dtype=np.float64))
        found = (
            Found(
                left=(cx - width / 2) / factor,
                top=(cy - height / 2) / factor,
                width=width / factor,
                height=height / factor,
                score=min(score, 1.0),
            )
            for cx, cy, width, height, score in rows.tolist()
            if score >= self._threshold and width > 0 and height > 0
        )
        return merged(found, self._overlap)

    def _blob(self, image: npt.NDArray[np.uint8], factor: float) -> Any:
        """The image in the upper left corner of a grey square, scaled, red-green-blue, 0..1."""
        scaled = np.asarray(cv2.resize(image, None, fx=factor, fy=factor), dtype=np.uint8)
        square = np.full((self._size, self._size, 3), _GREY, dtype=np.uint8)
        height, width = min(scaled.shape[0], self._size), min(scaled.shape[1], self._size)
        square[:height, :width] = scaled[:height, :width]
        return cv2.dnn.blobFromImage(square, 1 / 255.0, swapRB=True)

    def _rows(self, output: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """N × (centre x, centre y, width, height, score), in pixels of the square."""
        rows = output.reshape(output.shape[-2:])
        if self._layout == "v8":
            rows = rows.T
            return np.column_stack((rows[:, :4], rows[:, 4 + self._number]))
        return np.column_stack((rows[:, :4], rows[:, 4] * rows[:, 5 + self._number]))

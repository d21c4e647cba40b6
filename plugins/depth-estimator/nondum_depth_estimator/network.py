"""Distances by a network in ONNX, run by OpenCV's own inference on the CPU.

The weights are the operator's: none are shipped. Understood are exports with one input, 1 × 3 ×
height × width, red-green-blue, and one output of one number for each pixel, metric or inverse.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from nondum.sdk.errors import ConfigRefused, Problem
from nondum_depth_estimator.settings import Settings

_COLOURS = {
    "imagenet": ((0.485, 0.456, 0.406), (0.229, 0.224, 0.225)),
    "unit": ((0.0, 0.0, 0.0), (1.0, 1.0, 1.0)),
}
"""What is taken off red, green and blue, 0..1, and what the rest is divided by."""
Distances = npt.NDArray[np.float32]
"""Rows from the top, metres along the optical axis; NaN: not known."""


class DepthNetwork:
    """Says how far away things are."""

    def __init__(self, weights: Path, settings: Settings) -> None:
        """Raises `ConfigRefused` (WEIGHTS_UNREADABLE)."""
        self._settings = settings
        self._where = str(weights)
        try:
            self._network: Any = cv2.dnn.readNetFromONNX(str(weights))
        except cv2.error as error:
            raise _refused(self._where, str(error)) from error

    def distances(self, image: npt.NDArray[np.uint8]) -> Distances:
        """Of a blue-green-red image; as many rows and columns as the network gives.

        Raises `ConfigRefused` (WEIGHTS_UNREADABLE) when it takes or gives something else.
        """
        self._network.setInput(self._blob(image))
        try:
            answer = np.asarray(self._network.forward(), dtype=np.float32)
        except cv2.error as error:
            raise _refused(self._where, str(error)) from error
        if answer.ndim < 2 or answer.size != answer.shape[-1] * answer.shape[-2]:
            shape = " × ".join(map(str, answer.shape))
            raise _refused(self._where, f"gives {shape} numbers, not one for each pixel")
        return self._metres(answer.reshape(answer.shape[-2:]))

    def _blob(self, image: npt.NDArray[np.uint8]) -> Any:
        size = self._settings.width, self._settings.height
        scaled = np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), dtype=np.float32)
        colours = scaled[:, :, ::-1] / np.float32(255.0)
        mean, deviation = np.asarray(_COLOURS[self._settings.colours], dtype=np.float32)
        return np.ascontiguousarray(((colours - mean) / deviation).transpose(2, 0, 1)[None])

    def _metres(self, answer: Distances) -> Distances:
        values = answer * np.float32(self._settings.scale) + np.float32(self._settings.shift)
        if self._settings.output == "inverse":
            with np.errstate(divide="ignore"):
                values = np.float32(1.0) / values
        is_known = (values > 0) & (values <= self._settings.furthest_m)
        return np.where(is_known, values, np.float32(np.nan)).astype(np.float32)


def _refused(where: str, why: str) -> ConfigRefused:
    fix = "export the network to ONNX with one input and one output, and put that on the drive"
    return ConfigRefused(Problem("WEIGHTS_UNREADABLE", why, where=where, fix=fix))

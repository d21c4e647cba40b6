"""People by histograms of oriented gradients and a linear SVM, on any CPU.

Dalal and Triggs, "Histograms of oriented gradients for human detection", CVPR 2005, in OpenCV's
implementation with its default detector: windows of 64×128 pixels, in which a person is about 96
pixels high.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from nondum_people_detector.boxes import Found, merged

_WINDOW = (64, 128)
_STRIDE = (8, 8)
_BODY = (0.5, 0.75)
"""The share of a window's width and height that the person fills."""


class HogDetector:
    """Finds upright people that are at least `96 / enlarge` pixels high."""

    def __init__(
        self, *, threshold: float = 0.3, scale: float = 1.05, enlarge: float = 1.0,
        overlap: float = 0.5,
    ) -> None:  # fmt: skip
        """`threshold`: least distance from the SVM's plane; `scale`: step of the image pyramid;
        `enlarge`: factor for the image before the search; `overlap`: see `merged`."""
        self._threshold = threshold
        self._scale = scale
        self._enlarge = enlarge
        self._overlap = overlap
        self._hog: Any = cv2.HOGDescriptor()
        self._hog.setSVMDetector(np.asarray(cv2.HOGDescriptor.getDefaultPeopleDetector()))

    def find(self, image: npt.NDArray[np.uint8]) -> tuple[Found, ...]:
        """People in a grey or blue-green-red image, best first, boxes trimmed to the body."""
        if self._enlarge != 1.0:
            image = np.asarray(
                cv2.resize(image, None, fx=self._enlarge, fy=self._enlarge), dtype=np.uint8
            )
        if image.shape[0] < _WINDOW[1] or image.shape[1] < _WINDOW[0]:
            return ()
        # OpenCV's own grouping wants three answers per person and loses one of two who walk
        # side by side; `merged` keeps both.
        boxes, scores = self._hog.detectMultiScale(
            image,
            hitThreshold=self._threshold,
            winStride=_STRIDE,
            scale=self._scale,
            groupThreshold=0,
        )
        answers = (
            self._window(box, score) for box, score in zip(boxes, np.ravel(scores), strict=True)
        )
        return tuple(_trimmed(window) for window in merged(answers, self._overlap))

    def _window(self, box: Any, score: Any) -> Found:
        left, top, width, height = (float(edge) / self._enlarge for edge in box)
        return Found(left, top, width, height, float(score))


def _trimmed(window: Found) -> Found:
    width, height = window.width * _BODY[0], window.height * _BODY[1]
    return replace(
        window,
        left=window.left + (window.width - width) / 2,
        top=window.top + (window.height - height) / 2,
        width=width,
        height=height,
    )

"""Pedestrians by histograms of oriented gradients, in windows of 48×96 pixels.

The linear SVM was trained on the Daimler pedestrian benchmark (Enzweiler and Gavrila, "Monocular
pedestrian detection: survey and experiments", PAMI 2009); OpenCV ships it.
"""

from __future__ import annotations

import math
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from nondum.sdk import BoundingBox2D, Detection, Detections, Image
from nondum_pedestrian_detector.settings import Settings
from nondum_pedestrian_detector.windows import Floats, people

WINDOW = (48, 96)
_STRIDE = (8, 8)
_BODY = (0.5, 0.75)
"""The share of a window's width and height that the person fills."""
_TO_GREY = {"bgr8": cv2.COLOR_BGR2GRAY, "rgb8": cv2.COLOR_RGB2GRAY}


class Spotter:
    """Finds upright people from about 70 pixels of height on."""

    def __init__(self, settings: Settings) -> None:
        cv2.setNumThreads(settings.threads)
        self._settings = settings
        self._hog: Any = cv2.HOGDescriptor(WINDOW, (16, 16), (8, 8), (8, 8), 9)
        self._hog.setSVMDetector(np.asarray(cv2.HOGDescriptor.getDaimlerPeopleDetector()))

    def spot(self, image: Image, class_id: str) -> Detections:
        """The people in an image, surest first, with the image's stamp, frame and camera.

        Scores are distances from the SVM's plane, squeezed into 0..1; they are no probabilities.
        """
        windows, scores = people(*self._windows(grey(image)), self._settings.overlap)
        return Detections(
            header=image.header,
            detections=tuple(
                _detection(class_id, window, score)
                for window, score in zip(windows.tolist(), scores.tolist(), strict=True)
            ),
            image_width=image.width,
            image_height=image.height,
            camera=image.camera,
        )

    def _windows(self, image: npt.NDArray[np.uint8]) -> tuple[Floats, Floats]:
        if image.shape[0] < WINDOW[1] or image.shape[1] < WINDOW[0]:
            return np.empty((0, 4)), np.empty(0)
        windows, scores = self._hog.detectMultiScale(
            image,
            hitThreshold=self._settings.threshold,
            winStride=_STRIDE,
            scale=self._settings.scale,
            groupThreshold=0,
        )
        return np.reshape(windows, (-1, 4)).astype(np.float64), np.ravel(scores).astype(np.float64)


def grey(image: Image) -> npt.NDArray[np.uint8]:
    """The image in 8 bits of grey, as the SVM was trained; 16 bits are stretched from darkest to
    brightest."""
    array: Any = image.array()
    if image.encoding in _TO_GREY:
        array = cv2.cvtColor(array, _TO_GREY[image.encoding])
    elif image.encoding == "mono16":
        array = np.interp(array, (array.min(), array.max()), (0, 255))
    return np.asarray(array, dtype=np.uint8)


def _detection(class_id: str, window: list[float], score: float) -> Detection:
    left, top, width, height = window
    middle = (left + width / 2, top + height / 2)
    box = BoundingBox2D(*middle, width * _BODY[0], height * _BODY[1])
    return Detection(class_id, 1 / (1 + math.exp(-score)), box)

"""From an image message to a detections message, with any of the detectors."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Protocol

import cv2
import numpy as np
import numpy.typing as npt

from nondum.sdk import BoundingBox2D, Detection, Detections, Image
from nondum_people_detector.boxes import Found
from nondum_people_detector.hog import HogDetector
from nondum_people_detector.network import NetworkDetector
from nondum_people_detector.settings import Settings


class Detector(Protocol):
    """Finds things in an image."""

    def find(self, image: npt.NDArray[np.uint8]) -> tuple[Found, ...]:
        """Things in a grey or blue-green-red image of 8 bits, best first."""


def detector(settings: Settings, weights: Path | None) -> Detector:
    """The detector that the weights are of, if there are any; by HOG without.

    Raises `ConfigRefused` (WEIGHTS_UNREADABLE).
    """
    cv2.setNumThreads(settings.threads)
    if weights is not None:
        return NetworkDetector(
            weights,
            size=settings.weights_size,
            layout=settings.weights_layout,
            number=settings.weights_class,
            threshold=settings.threshold,
            overlap=settings.overlap,
        )
    return HogDetector(
        threshold=settings.threshold,
        scale=settings.scale,
        enlarge=settings.enlarge,
        overlap=settings.overlap,
    )


def detect(finder: Detector, image: Image, *, is_probability: bool) -> Detections:
    """What is found in an image, with its stamp, frame and camera.

    Scores that are no probabilities, like distances from a plane, are squeezed into 0..1.
    """
    found = finder.find(pixels(image))
    return Detections(
        header=image.header,
        detections=tuple(_detection(box, is_probability=is_probability) for box in found),
        image_width=image.width,
        image_height=image.height,
        camera=image.camera,
    )


def pixels(image: Image) -> npt.NDArray[np.uint8]:
    """The image as 8 bits, grey or blue-green-red; 16 bits are stretched from darkest to brightest,
    as thermal cameras use a small part of their range."""
    array: Any = image.array()
    if image.encoding == "rgb8":
        array = cv2.cvtColor(array, cv2.COLOR_RGB2BGR)
    elif image.encoding == "mono16":
        array = _stretched(array)
    return np.asarray(array, dtype=np.uint8)


def _stretched(array: Any) -> Any:
    dark, bright = int(array.min()), int(array.max())
    return (array - float(dark)) * (255.0 / max(bright - dark, 1))


def _detection(box: Found, *, is_probability: bool) -> Detection:
    score = box.score if is_probability else 1 / (1 + math.exp(-box.score))
    middle = (box.left + box.width / 2, box.top + box.height / 2)
    return Detection(box.class_id, score, BoundingBox2D(*middle, box.width, box.height))

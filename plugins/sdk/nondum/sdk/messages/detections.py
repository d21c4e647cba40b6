"""What a detector found in an image (vision_msgs/Detection2DArray)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

from nondum.sdk.frozen import frozen
from nondum.sdk.messages.fields import Message
from nondum.sdk.messages.header import Header
from nondum.sdk.messages.images import CameraModel


@frozen
class BoundingBox2D:
    """An upright box in the image, by its centre and size in pixels."""

    cx: float
    """px, of its centre, to the right."""
    cy: float
    """px, of its centre, down."""
    width: float
    """px"""
    height: float
    """px"""


@frozen
class Detection:
    """One thing found."""

    class_id: str
    """An object of type `class` in planning: `person`."""
    score: float
    """0..1, higher is surer."""
    box: BoundingBox2D
    """Where in the image."""
    id: str = ""
    """The same over time where the detector follows things; empty where it does not."""


@frozen
class Detections(Message):
    """All that was found in one image; its stamp and frame are the image's."""

    TYPE: ClassVar[str] = "detections"
    header: Header
    detections: tuple[Detection, ...]
    """In no particular order."""
    image_width: int
    """px, of the image that was looked at."""
    image_height: int
    """px"""
    camera: CameraModel | None = None
    """The image's, for the direction of what was found."""

    def faults(self) -> Iterator[str]:
        """An empty image, scores outside 0..1, boxes without size."""
        if self.image_width <= 0 or self.image_height <= 0:
            yield f"image size {self.image_width}×{self.image_height} is not positive"
        for i, found in enumerate(self.detections):
            if not 0 <= found.score <= 1:
                yield f"detections[{i}].score {found.score} is not within 0..1"
            if found.box.width <= 0 or found.box.height <= 0:
                yield f"detections[{i}].box has no size"

"""Looking into a panorama: what a level pinhole camera sees of a cylinder."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from nondum_panorama.clip import Clip
from nondum_panorama.recording import Frame


@dataclass(frozen=True, slots=True)
class View:
    """A pinhole camera: size in pixels and horizontal field of view."""

    width: int = 480
    height: int = 320
    field_of_view_deg: float = 70.0

    def __post_init__(self) -> None:
        if not 0 < self.field_of_view_deg < 150:
            raise ValueError(f"a pinhole camera cannot see {self.field_of_view_deg} degrees")
        if min(self.width, self.height) < 16:
            raise ValueError(f"a view of {self.width}×{self.height} pixels is too small")

    @property
    def focal_px(self) -> float:
        """Focal length in pixels, the same along rows and columns."""
        return self.width / 2 / math.tan(math.radians(self.field_of_view_deg) / 2)

    @property
    def centre(self) -> tuple[float, float]:
        """Column and row of the optical axis."""
        return ((self.width - 1) / 2, (self.height - 1) / 2)


_BEYOND = (100, 100, 100, 0)


class Lens:
    """Renders views of one panorama; the maps of the projection are made once.

    Beyond the edges of the recording everything is grey: repeating the last column would smear
    a person who stands at the edge over half the view.
    """

    def __init__(self, clip: Clip, view: View) -> None:
        self._clip = clip
        cx, cy = view.centre
        across = (np.arange(view.width) - cx) / view.focal_px
        down = (np.arange(view.height) - cy) / view.focal_px
        azimuth = np.arctan(across)
        offsets = azimuth * clip.pixels_per_rad
        self._columns = np.tile(offsets.astype(np.float32), (view.height, 1))
        rows = clip.horizon_row + np.outer(down, np.cos(azimuth)) * clip.pixels_per_rad
        self._rows = rows.astype(np.float32)

    def look(self, frame: Frame, azimuth: float) -> Frame:
        """What the camera sees of `frame` (colour or grey) along `azimuth` radians to the left
        of straight ahead at the start."""
        columns = self._columns + np.float32(self._clip.column(azimuth))
        seen = cv2.remap(
            frame,
            columns,
            self._rows,
            cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_CONSTANT,
            borderValue=_BEYOND,
        )
        return np.asarray(seen, dtype=np.uint8)

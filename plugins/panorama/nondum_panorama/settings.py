"""Settings that panning cameras share."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from nondum_panorama.clip import Clip, packaged_clip, read_clip
from nondum_panorama.view import View


@dataclass(frozen=True, slots=True)
class CameraSettings:
    """What an integrator may set; see the README for each."""

    clip: str = ""
    """Notes (TOML) of another recording; empty: the packaged one."""
    width: int = 480
    height: int = 320
    """Pixels of the view."""
    field_of_view_deg: float = 70.0
    """Horizontal field of view of the view (and of the real camera, where one is plugged in)."""
    looks_deg: float = 0.0
    """Where the camera really looks on its body, to the left of ahead. The mount says where it is
    believed to look: set only one of them to see what a wrong mount does."""
    hold_s: float = 3.0
    """How long the first frame stands still after the stream began."""
    pace: Literal["real-time", "every-frame"] = "real-time"
    """`real-time` leaves frames out when the machine is slow; `every-frame` slows down."""
    speed: float = 1.0
    """How fast the recording is played: 0.1 is slow motion, for who sees an image a second."""

    def __post_init__(self) -> None:
        self.view  # noqa: B018  # refuses impossible views when the settings are made
        if self.hold_s < 0:
            raise ValueError(f"hold_s is {self.hold_s}; it cannot be negative")
        if self.speed <= 0:
            raise ValueError(f"speed is {self.speed}; it must be positive")

    @property
    def view(self) -> View:
        """The view's size and angle. Raises `ValueError`."""
        return View(self.width, self.height, self.field_of_view_deg)

    def read_clip(self) -> Clip:
        """The clip that is played. Raises `OSError`, `ValueError`."""
        return read_clip(Path(self.clip)) if self.clip else packaged_clip()

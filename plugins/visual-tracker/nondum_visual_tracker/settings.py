"""What an integrator may set; see the README for each."""

from __future__ import annotations

import math
from dataclasses import dataclass

from nondum_visual_tracker.controller import Gains


@dataclass(frozen=True, slots=True)
class Settings:
    """Angles in degrees, distances in metres, times in seconds."""

    turn_gain: float = 2.5
    feed_forward: float = 1.0
    dead_band_deg: float = 1.0
    max_turn_deg_s: float = 70.0
    distance_m: float = 2.0
    approach_gain: float = 0.5
    max_speed_m_s: float = 0.6
    max_reverse_m_s: float = 0.2
    person_m: float = 1.7
    coast_s: float = 1.5
    stop_s: float = 3.0
    search_deg_s: float = 25.0
    give_up_s: float = 60.0
    """Out of sight for so long: `track` and `watch` fail."""
    field_of_view_deg: float = 60.0
    """Horizontal, for images that come without a camera model."""

    def __post_init__(self) -> None:
        for name in ("max_turn_deg_s", "max_speed_m_s", "person_m", "distance_m", "give_up_s"):
            if getattr(self, name) <= 0:
                raise ValueError(f"{name} is {getattr(self, name)}; it must be positive")
        if not 0 < self.coast_s <= self.stop_s:
            raise ValueError("coast_s must be positive and stop_s not shorter")
        if not 0 < self.field_of_view_deg < 150:
            raise ValueError("field_of_view_deg must lie between 0 and 150")

    @property
    def gains(self) -> Gains:
        """The control law's numbers."""
        return Gains(
            turn_gain=self.turn_gain,
            feed_forward=self.feed_forward,
            dead_band_rad=math.radians(self.dead_band_deg),
            max_turn_rad_s=math.radians(self.max_turn_deg_s),
            approach_gain=self.approach_gain,
            distance_m=self.distance_m,
            max_speed_m_s=self.max_speed_m_s,
            max_reverse_m_s=self.max_reverse_m_s,
            person_m=self.person_m,
            coast_s=self.coast_s,
            stop_s=self.stop_s,
            search_rad_s=math.radians(self.search_deg_s),
        )

"""What an integrator may set; see the README for each."""

from __future__ import annotations

import math
from dataclasses import dataclass

from nondum_mobile_base.unicycle import Limits, Motion


@dataclass(frozen=True, slots=True)
class Settings:
    """Limits of the simulated base, and how it stands at first (degrees to the left)."""

    max_speed_m_s: float = 0.8
    max_reverse_m_s: float = 0.3
    max_turn_deg_s: float = 90.0
    acceleration_m_s2: float = 1.0
    turn_acceleration_deg_s2: float = 230.0
    deadline_s: float = 0.3
    start_heading_deg: float = 0.0

    def __post_init__(self) -> None:
        self.limits  # noqa: B018  # refuses impossible limits when the settings are made

    @property
    def limits(self) -> Limits:
        """The base's hard limits. Raises `ValueError`."""
        return Limits(
            speed_m_s=self.max_speed_m_s,
            reverse_m_s=self.max_reverse_m_s,
            turn_rad_s=math.radians(self.max_turn_deg_s),
            acceleration_m_s2=self.acceleration_m_s2,
            turn_acceleration_rad_s2=math.radians(self.turn_acceleration_deg_s2),
            deadline_s=self.deadline_s,
        )

    @property
    def start(self) -> Motion:
        """How the base stands when its component starts."""
        return Motion(heading=math.radians(self.start_heading_deg))

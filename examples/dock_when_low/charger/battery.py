"""A simulated battery."""

from __future__ import annotations

LOW, FULL = 0.2, 0.95
"""It is low from `LOW` down until it is charged to `FULL` again."""


class SimulatedBattery:
    """Its charge, 0 to 1."""

    def __init__(self, charge: float = 1.0) -> None:
        self.charge = charge
        self._is_low = False

    @property
    def is_low(self) -> bool:
        """Whether it should be charged."""
        self._is_low = self.charge < (FULL if self._is_low else LOW)
        return self._is_low

    def change(self, by: float) -> None:
        """Charge it, or discharge it."""
        self.charge = min(1.0, max(0.0, self.charge + by))

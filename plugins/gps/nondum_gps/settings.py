"""What an integrator may set; see the README for each."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Settings:
    """How the receiver is listened to."""

    baud: int = 9600
    """Of the serial line; NMEA 0183 says 4800, receivers on sale 9600. USB CDC ignores it."""
    lost_after_s: float = 5.0
    """The position is forgotten when the last fix is older than this."""
    range_error_m: float = 5.0
    """Standard error of one range, which the dilution of precision is multiplied by."""

    def __post_init__(self) -> None:
        if not 1 <= self.baud <= 4_000_000:
            raise ValueError("baud must lie between 1 and 4000000")
        for name in ("lost_after_s", "range_error_m"):
            if getattr(self, name) <= 0:
                raise ValueError(f"{name} must be positive")

"""What an integrator may set, checked once."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields

from nondum.sdk.errors import ConfigRefused, Problem


@dataclass(frozen=True, slots=True)
class Settings:
    """All are positive numbers."""

    line_kev: float = 661.657
    """Photopeak that is imaged: caesium-137. Cobalt-60: 1332.492."""
    accuracy_deg: float = 0.5
    """A bearing is good when its standard error is below this."""
    timeout_s: float = 120.0
    """Give up after that long without a good bearing."""
    baud: float = 460800.0

    @classmethod
    def parse(cls, given: Mapping[str, object]) -> Settings:
        """Check settings from outside. Raises `ConfigRefused` with everything that is wrong."""
        known = [field.name for field in fields(cls)]
        problems = [
            *(_problem(key, f"is none of {', '.join(known)}") for key in given if key not in known),
            *(
                _problem(key, f"must be a positive number, not {value!r}")
                for key, value in given.items()
                if key in known and not _is_positive(value)
            ),
        ]
        if problems:
            raise ConfigRefused(*problems)
        return cls(**{key: float(str(value)) for key, value in given.items()})


def _is_positive(value: object) -> bool:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return is_number and math.isfinite(float(str(value))) and float(str(value)) > 0


def _problem(key: str, what: str) -> Problem:
    return Problem("SETTING_INVALID", f"setting {key!r} {what}", where="compton-camera")

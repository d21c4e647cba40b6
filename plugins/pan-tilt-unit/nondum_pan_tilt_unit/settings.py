"""What an integrator may set, checked once."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields

from nondum.sdk.errors import ConfigRefused, Problem

_POSITIVE = ("speed_deg_s", "answer_s")


@dataclass(frozen=True, slots=True)
class Settings:
    """Angles in degrees, in the unit's own frame: pan left positive, tilt up positive."""

    pan_min_deg: float = -180.0
    pan_max_deg: float = 180.0
    """The head never turns beyond these, nor beyond what the unit itself reports."""
    tilt_min_deg: float = -90.0
    tilt_max_deg: float = 90.0
    speed_deg_s: float = 100.0
    answer_s: float = 3.0
    """A command that has no answer by then has none: the unit itself takes some milliseconds."""
    reset: bool = False
    """Drive to the ends before the first aim, as after a power-up that could not reach them."""

    @classmethod
    def parse(cls, given: Mapping[str, object]) -> Settings:
        """Check settings from outside. Raises `ConfigRefused` with everything that is wrong."""
        problems = list(_problems(given))
        if problems:
            raise ConfigRefused(*problems)
        return cls(**{key: _value(value) for key, value in given.items()})  # type: ignore[arg-type]  # checked by `_problems`


def _problems(given: Mapping[str, object]) -> Iterator[Problem]:
    known = {field.name: type(field.default) for field in fields(Settings)}
    for key, value in given.items():
        if key not in known:
            yield _problem(f"setting {key!r} is none of {', '.join(known)}")
        elif known[key] is bool and not isinstance(value, bool):
            yield _problem(f"setting {key!r} must be true or false, not {value!r}")
        elif known[key] is float and not _is_number(value):
            yield _problem(f"setting {key!r} must be a number, not {value!r}")
        elif key in _POSITIVE and float(str(value)) <= 0:
            yield _problem(f"setting {key!r} must be positive, not {value!r}")


def _is_number(value: object) -> bool:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return is_number and math.isfinite(float(str(value)))


def _value(value: object) -> float | bool:
    return value if isinstance(value, bool) else float(str(value))


def _problem(message: str) -> Problem:
    return Problem("SETTING_INVALID", message, where="pan-tilt-unit")

"""Settings: what an integrator wrote, as the author's type."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import pytest

from nondum.sdk.errors import ConfigRefused
from nondum.sdk.settings import parse_settings


@dataclass(frozen=True)
class Settings:
    speed: float = 1.0
    count: int = 3
    is_loud: bool = False
    words: str = ""
    pace: Literal["slow", "fast"] = "slow"

    def __post_init__(self) -> None:
        if self.speed < 0:
            raise ValueError("speed is negative")


def refusals(**given: object) -> list[str]:
    with pytest.raises(ConfigRefused) as refused:
        parse_settings(Settings, given, where="here")
    assert {problem.code for problem in refused.value.problems} == {"SETTING_INVALID"}
    return [problem.message for problem in refused.value.problems]


def test_nothing_given_means_defaults() -> None:
    assert parse_settings(Settings, {}, where="here") == Settings()


def test_whole_numbers_serve_as_numbers() -> None:
    speed = parse_settings(Settings, {"speed": 2}, where="here").speed
    assert (speed, type(speed)) == (2.0, float)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"speed": "fast"}, "setting 'speed' must be a number, not 'fast'"),
        ({"speed": True}, "setting 'speed' must be a number, not True"),
        ({"speed": float("nan")}, "setting 'speed' must be a number, not nan"),
        ({"count": 1.5}, "setting 'count' must be a whole number, not 1.5"),
        ({"is_loud": 1}, "setting 'is_loud' must be true or false, not 1"),
        ({"words": 1}, "setting 'words' must be text, not 1"),
        ({"pace": "idle"}, "setting 'pace' must be one of 'slow', 'fast', not 'idle'"),
        ({"speed": -1}, "speed is negative"),
    ],
    ids=str,
)
def test_wrong_setting_is_refused(given: dict[str, object], words: str) -> None:
    assert refusals(**given) == [words]


def test_all_mistakes_are_told_at_once() -> None:
    first, second = refusals(sped=1, count="x")
    assert first.startswith("there is no setting 'sped'; known: speed, count")
    assert second == "setting 'count' must be a whole number, not 'x'"

"""Settings: what an integrator wrote, as the author's type."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import pytest
from tests.kit.golden import Golden

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
    ("given", "situation"),
    [
        ({"speed": "fast"}, "text for a number"),
        ({"speed": True}, "true for a number"),
        ({"speed": float("nan")}, "no number"),
        ({"count": 1.5}, "a fraction for a whole number"),
        ({"is_loud": 1}, "a number for true or false"),
        ({"words": 1}, "a number for text"),
        ({"pace": "idle"}, "another word than those"),
        ({"speed": -1}, "what the author refuses"),
    ],
    ids=str,
)
def test_wrong_setting_is_refused(given: dict[str, object], situation: str, golden: Golden) -> None:
    golden.check(situation, "\n".join(refusals(**given)))


def test_all_mistakes_are_told_at_once(golden: Golden) -> None:
    golden.check("two mistakes at once", "\n".join(refusals(sped=1, count="x")))

"""Settings are checked all at once."""

from __future__ import annotations

import pytest

from nondum.sdk.errors import ConfigRefused
from nondum_pan_tilt_unit.settings import Settings


def test_what_is_not_set_has_a_default() -> None:
    assert Settings.parse({}) == Settings()
    assert Settings.parse({"tilt_max_deg": 10, "reset": True}) == Settings(
        tilt_max_deg=10.0, reset=True
    )


def test_every_mistake_is_told() -> None:
    wrong = {"tilt_mx_deg": 1, "reset": 1, "pan_min_deg": "left", "speed_deg_s": 0}
    with pytest.raises(ConfigRefused) as raised:
        Settings.parse(wrong)
    assert len(raised.value.problems) == len(wrong)

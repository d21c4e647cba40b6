"""Directions become steps, and what is out of reach is refused with its numbers."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum.sdk.errors import BehaviourFailed
from nondum_pan_tilt_unit.aim import Axis, apart, pan_tilt

PAN = Axis.reported("pan", 185.1428, -3090, 3090)
_pans = st.floats(-3.1, 3.1)
_tilts = st.floats(-1.5, 1.5)


def direction(pan: float, tilt: float) -> tuple[float, float, float]:
    flat = math.cos(tilt)
    return flat * math.cos(pan), flat * math.sin(pan), math.sin(tilt)


@given(_pans, _tilts)
def test_angles_lead_back_to_the_direction(pan: float, tilt: float) -> None:
    assert pan_tilt(direction(pan, tilt)) == pytest.approx((pan, tilt), abs=1e-6)


@given(_pans, _tilts, _pans, _tilts)
def test_aims_are_as_far_apart_as_their_directions(
    pan: float, tilt: float, other_pan: float, other_tilt: float
) -> None:
    one, other = direction(pan, tilt), direction(other_pan, other_tilt)
    chord = math.dist(one, other)
    found = apart((pan, tilt), (other_pan, other_tilt))
    assert 2 * math.sin(found / 2) == pytest.approx(chord, abs=1e-9)


def test_the_manuals_example_is_kept() -> None:
    """ "To pan 21.3° left requires 414 positions" of 0.0514285°."""
    assert PAN.steps(math.radians(21.3)) == 414


@given(st.integers(-3090, 3090))
def test_steps_and_angles_agree(steps: int) -> None:
    assert PAN.steps(PAN.angle(steps)) == steps


def test_out_of_reach_tells_where_the_ends_are() -> None:
    with pytest.raises(BehaviourFailed) as raised:
        PAN.steps(math.radians(170))
    problem = raised.value.problems[0]
    assert (problem.code, problem.need, problem.have) == (
        "PTU_OUT_OF_REACH",
        "170.0°",
        "-158.9° to 158.9°",
    )


def test_an_integrators_limits_narrow_the_axis() -> None:
    narrow = PAN.limited(math.radians(-30), math.radians(400))
    assert math.degrees(narrow.angle(narrow.minimum)) == pytest.approx(-30, abs=0.06)
    assert narrow.maximum == 3090

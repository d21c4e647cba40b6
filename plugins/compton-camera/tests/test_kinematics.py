"""Compton's formula, and which events make cones."""

from __future__ import annotations

import numpy as np
import pytest

from nondum_compton_camera.kinematics import Instrument, cones, scatter_angle
from nondum_compton_camera.listmode import Event, Interaction

LINE = Instrument().line_kev


def event(first_kev: float, second_kev: float, apart_mm: float = 20.0) -> Event:
    """Interactions one above the other."""
    return Event(
        0,
        0,
        Interaction((0.0, 0.0, apart_mm / 2), first_kev),
        Interaction((0.0, 0.0, -apart_mm / 2), second_kev),
    )


def scattered(theta_rad: float) -> float:
    return float(LINE / (1 + LINE / 510.99895 * (1 - np.cos(theta_rad))))


@pytest.mark.parametrize("degrees", [10, 45, 90, 150, 180])
def test_angle_inverts_the_formula(degrees: int) -> None:
    theta = np.radians(degrees)
    found = scatter_angle(np.array([LINE]), np.array([scattered(theta)]))
    assert found[0] == pytest.approx(theta, abs=1e-5)


def test_energies_beyond_the_compton_edge_give_no_angle() -> None:
    assert np.isnan(scatter_angle(np.array([LINE]), np.array([scattered(np.pi) - 1])))[0]


@pytest.mark.parametrize("swapped", [False, True], ids=["in order", "swapped"])
def test_the_cone_is_that_of_the_true_order(*, swapped: bool) -> None:
    theta = 2.2
    absorbed = scattered(theta)
    deposited = (absorbed, LINE - absorbed) if swapped else (LINE - absorbed, absorbed)
    found = cones([event(*deposited)], Instrument())
    best = int(np.argmax(found.weights[0]))
    assert best == int(swapped)
    assert found.angles[0, best] == pytest.approx(theta, abs=1e-3)
    assert found.axes[0, best].tolist() == [0, 0, -1 if swapped else 1]


@pytest.mark.parametrize(
    "unfit",
    [
        event(100.0, 100.0),
        event(300.0, LINE - 300.0 + 20.0),
        event(300.0, LINE - 300.0, apart_mm=3.0),
        event(0.0, LINE),
    ],
    ids=["photon escaped", "above the line", "too close", "no scattering"],
)
def test_events_that_make_no_cone_are_left_out(unfit: Event) -> None:
    assert len(cones([unfit, event(300.0, LINE - 300.0)], Instrument())) == 1


def test_no_events_make_no_cones() -> None:
    assert len(cones([], Instrument())) == 0


def test_orders_are_weighed_to_one() -> None:
    found = cones([event(200.0, LINE - 200.0), event(300.0, LINE - 300.0)], Instrument())
    assert found.weights.sum(axis=1).tolist() == pytest.approx([1.0, 1.0])


def test_thinning_keeps_some_of_all_times() -> None:
    found = cones([event(200.0 + n / 10, LINE - 200.0 - n / 10) for n in range(500)], Instrument())
    few = found.thinned(5)
    assert len(few) == 5
    assert few.angles[0, 0] == found.angles[0, 0]
    assert few.angles[-1, 0] == found.angles[-1, 0]
    assert len(found.thinned(10_000)) == len(found)


def test_worse_resolution_makes_thicker_cones() -> None:
    pair = event(300.0, LINE - 300.0)
    fine, coarse = (
        cones([pair], Instrument(position_sigma_mm=sigma)).sigmas[0, 0] for sigma in (0.3, 1.0)
    )
    assert coarse > 2 * fine

"""The simulated detector obeys the physics it is told to."""

from __future__ import annotations

import numpy as np
import pytest
from demo.emulators import detector

LINE_KEV = 661.657
AHEAD_MM = np.array((20_000.0, 0.0, 0.0))


def rng() -> np.random.Generator:
    return np.random.default_rng(7)


def test_attenuation_is_the_published_one() -> None:
    energies = np.array((511.0, 662.0, 1250.0))
    per_electron = detector.compton_per_mm(energies) / detector.ELECTRONS_PER_MM
    assert per_electron == pytest.approx(
        (2.872, 2.564, 1.891), rel=0.01
    )  # 1e-25 cm², from NIST's water


@pytest.mark.parametrize("energy_kev", [100.0, 662.0, 2614.0])
def test_scattering_follows_klein_nishina(energy_kev: float) -> None:
    cosines = detector.klein_nishina(rng(), np.full(200_000, energy_kev))
    edges = np.linspace(-1, 1, 11)
    counts, _ = np.histogram(cosines, edges)
    grid = np.linspace(-1, 1, 20_001)
    ratio = 1 / (1 + energy_kev / detector.ELECTRON_KEV * (1 - grid))
    density = ratio**2 * (ratio + 1 / ratio - 1 + grid**2)
    expected, _ = np.histogram(grid, edges, weights=density)
    assert counts / counts.sum() == pytest.approx(expected / expected.sum(), abs=0.005)


def test_full_absorption_makes_the_line() -> None:
    pairs = detector.from_point(rng(), AHEAD_MM, LINE_KEV, 100_000)
    total = pairs.energies_kev.sum(axis=1)
    peak = total[np.abs(total - LINE_KEV) < 20]
    assert np.median(peak) == pytest.approx(LINE_KEV, abs=0.5)
    # Two deposits, each with its share of the resolution: their sum has that of the line.
    assert 2.3548 * peak.std() == pytest.approx(detector.ENERGY_FWHM_KEV, rel=0.15)


def test_some_photons_escape_with_part_of_the_energy() -> None:
    pairs = detector.from_point(rng(), AHEAD_MM, LINE_KEV, 100_000)
    assert 0.3 < np.mean(pairs.energies_kev.sum(axis=1) < LINE_KEV - 30) < 0.95


def test_the_order_of_interactions_tells_nothing() -> None:
    pairs = detector.from_point(rng(), AHEAD_MM, LINE_KEV, 100_000)
    first, second = pairs.energies_kev.T
    assert np.mean(first > second) == pytest.approx(0.5, abs=0.02)


def test_all_lies_in_the_block_and_apart() -> None:
    pairs = detector.from_around(rng(), np.full(50_000, LINE_KEV))
    assert len(pairs) > 1000
    reach = detector.BLOCK_MM / 2 + 6 * detector.POSITION_SIGMA_MM
    assert np.all(np.abs(pairs.positions_mm) <= reach)
    apart = np.linalg.norm(pairs.positions_mm[:, 0] - pairs.positions_mm[:, 1], axis=1)
    assert apart.min() > detector.SEPARATION_MM - 6 * detector.POSITION_SIGMA_MM


def test_the_near_side_sees_more() -> None:
    pairs = detector.from_point(rng(), AHEAD_MM, LINE_KEV, 200_000)
    ahead = pairs.positions_mm[:, :, 0].mean(axis=1) > 0
    assert np.mean(ahead) > 0.55

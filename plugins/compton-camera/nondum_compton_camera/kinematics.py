"""From two interactions to the cone of directions that the photon may have come from.

Compton's formula gives the scattering angle, cos θ = 1 − mₑc² (1/E′ − 1/E), where E is the photon's
energy and E′ what the second interaction absorbed; the line through both interactions is the axis.
Sources: A. H. Compton, Phys. Rev. 21 (1923) 483; O. Klein and Y. Nishina, Z. Phys. 52 (1929) 853;
Doppler broadening: C. E. Ordonez, A. Bolozdynya, W. Chang, IEEE Trans. Nucl. Sci. 44 (1997) 204;
which interaction came first: D. Xu et al., Proc. SPIE 5540 (2004) 144.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nondum_compton_camera.listmode import Event

ELECTRON_KEV = 510.998_950
"""Rest energy of the electron (CODATA 2018)."""

_FIT_SIGMAS = 2.5
_ANGLES_RAD = (0.15, 2.7)
"""Outside these a cone is a pencil, and its width is all resolution."""
_PHOTOABSORPTION = -3.0
"""Exponent of the photoelectric cross-section in energy."""

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Instrument:
    """How well the instrument measures; what cones are as thick as."""

    line_kev: float = 661.657
    """The photopeak that is imaged: caesium-137's unless told otherwise."""
    fwhm_kev: float = 10.0
    """Energy resolution at the line; it goes with the root of the energy."""
    position_sigma_mm: float = 0.5
    doppler_sigma_rad: float = 0.02
    """Blur of θ because the electrons of the detector move."""
    lever_mm: float = 8.0
    """Interactions nearer to each other say too little about their axis."""

    def energy_sigma_kev(self, energy_kev: Floats) -> Floats:
        return self.fwhm_kev / 2.3548 * np.sqrt(energy_kev / self.line_kev)


@dataclass(frozen=True, slots=True)
class Cones:
    """N events, each with both orders of its interactions; an impossible order has weight 0."""

    axes: Floats
    """(N, 2, 3) unit vectors from the absorbing to the scattering interaction."""
    angles: Floats
    """(N, 2) half opening angles, rad."""
    sigmas: Floats
    """(N, 2) thicknesses, rad."""
    weights: Floats
    """(N, 2) probability of the order; rows sum to 1."""

    def __len__(self) -> int:
        return len(self.axes)

    def thinned(self, count: int) -> Cones:
        """At most `count` of them, spread evenly over the time they took."""
        kept = np.unique(np.linspace(0, len(self) - 1, min(count, len(self))).astype(int))
        return Cones(self.axes[kept], self.angles[kept], self.sigmas[kept], self.weights[kept])


def cones(events: Sequence[Event], instrument: Instrument) -> Cones:
    """The cones of those events that absorbed the whole line far enough apart, in order.

    Of N events at most N are left: the others deposited another energy (background, or photons
    that escaped), lie closer than the lever, or fit Compton's formula in neither order.
    """
    positions, energies = _columns(events)
    orders = [_order(positions, energies, first, instrument) for first in (0, 1)]
    axes, angles, sigmas, weights = (np.stack(part, axis=1) for part in zip(*orders, strict=True))
    total = weights.sum(axis=1)
    lever = np.linalg.norm(positions[:, 0] - positions[:, 1], axis=1)
    kept = _at_line(energies, instrument) & (lever >= instrument.lever_mm) & (total > 0)
    return Cones(axes[kept], angles[kept], sigmas[kept], weights[kept] / total[kept, None])


def scatter_angle(energy_kev: Floats, scattered_kev: Floats) -> Floats:
    """θ in rad for a photon of `energy_kev` that left with `scattered_kev`; NaN if impossible.

    >>> float(np.degrees(scatter_angle(np.array([511.0]), np.array([255.5]))).round(1)[0])
    90.0
    """
    cosine = 1 - ELECTRON_KEV * (1 / scattered_kev - 1 / energy_kev)
    return np.arccos(np.where(np.abs(cosine) <= 1, cosine, np.nan))


def _columns(events: Sequence[Event]) -> tuple[Floats, Floats]:
    hits = [(event.first, event.second) for event in events]
    positions = np.array([[hit.position_mm for hit in pair] for pair in hits], dtype=float)
    energies = np.array([[hit.energy_kev for hit in pair] for pair in hits], dtype=float)
    return positions.reshape(-1, 2, 3), energies.reshape(-1, 2)


def _at_line(energies: Floats, instrument: Instrument) -> NDArray[np.bool_]:
    total = energies.sum(axis=1)
    sigma = instrument.energy_sigma_kev(np.asarray(instrument.line_kev))
    return np.asarray(np.abs(total - instrument.line_kev) <= _FIT_SIGMAS * sigma)


def _order(
    positions: Floats, energies: Floats, first: int, instrument: Instrument
) -> tuple[Floats, Floats, Floats, Floats]:
    """Axis, angle, thickness and unnormalised weight if interaction `first` scattered."""
    apart = positions[:, first] - positions[:, 1 - first]
    lever = np.maximum(np.linalg.norm(apart, axis=1), 1e-3)
    absorbed, absorbed_sigma = _fitted(energies[:, first], energies[:, 1 - first], instrument)
    theta = scatter_angle(np.full_like(absorbed, instrument.line_kev), absorbed)
    possible = (theta > _ANGLES_RAD[0]) & (theta < _ANGLES_RAD[1])
    theta = np.where(possible, theta, np.pi / 2)
    energy_blur = ELECTRON_KEV / absorbed**2 / np.sin(theta) * absorbed_sigma
    axis_blur = np.sqrt(2) * instrument.position_sigma_mm / lever
    sigma = np.sqrt(energy_blur**2 + axis_blur**2 + instrument.doppler_sigma_rad**2)
    weight = np.where(possible, _likelihood(absorbed, theta, instrument.line_kev), 0.0)
    return apart / lever[:, None], theta, sigma, weight


def _fitted(scattered: Floats, absorbed: Floats, instrument: Instrument) -> tuple[Floats, Floats]:
    """The absorbed energy, and its sigma, given that both add up to the line exactly."""
    scattered_sigma = instrument.energy_sigma_kev(np.maximum(scattered, 1.0))
    absorbed_sigma = instrument.energy_sigma_kev(np.maximum(absorbed, 1.0))
    share = absorbed_sigma**2 / (scattered_sigma**2 + absorbed_sigma**2)
    missing = instrument.line_kev - scattered - absorbed
    fitted = np.clip(absorbed + share * missing, 1.0, instrument.line_kev - 1.0)
    return fitted, np.sqrt(share) * scattered_sigma


def _likelihood(absorbed: Floats, theta: Floats, line_kev: float) -> Floats:
    """How likely that energy is scattered first (Klein-Nishina) and the rest then absorbed."""
    ratio = absorbed / line_kev
    density = ratio + 1 / ratio - np.sin(theta) ** 2
    return np.asarray(density * absorbed**_PHOTOABSORPTION)

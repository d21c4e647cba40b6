"""The physics of a block of cadmium zinc telluride that images gamma rays by Compton scattering.

Photons from a point source and from all around enter a block; where they scatter goes by the
Klein-Nishina formula, what the electron's own motion does to the energies by its momentum (Doppler
broadening, Ordonez, Bolozdynya and Chang 1997, linear in the momentum), whether the scattered
photon is absorbed or gets away by the cross-sections. Only pairs of interactions are kept; energies
and positions are then blurred as electronics would. Written apart from any driver, so that each can
show the other's mistakes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from demo.emulators.pose import Floats

ELECTRON_KEV = 510.99895
FINE_STRUCTURE = 1 / 137.036
BLOCK_MM = np.array((66.0, 66.0, 30.0))
ELECTRONS_PER_MM = 0.384 / 2.56 / 10
"""Electron density of CZT, in units that make 0.384 /cm of the 2.56e-25 cm² at 662 keV."""
PHOTO_PER_MM = 0.80
"""Photoelectric absorption at 100 keV; it falls with the energy to the power 2.9."""
ENERGY_FWHM_KEV = 10.0
"""At 662 keV; goes with the root of the energy."""
POSITION_SIGMA_MM = 0.5
MOMENTUM_SCALE = 0.6 * FINE_STRUCTURE
"""Of the electrons along the scattering vector, in mₑc; tails as Student's t with 3 degrees."""
THRESHOLD_KEV = 25.0
SEPARATION_MM = 4.0
"""Nearer interactions are read out as one."""


@dataclass(frozen=True, slots=True)
class Pairs:
    """Measured pairs of interactions, in an order that tells nothing."""

    positions_mm: Floats
    """(N, 2, 3)"""
    energies_kev: Floats
    """(N, 2)"""

    def __len__(self) -> int:
        return len(self.energies_kev)


def from_point(
    rng: np.random.Generator, source_mm: Floats, energy_kev: float, photons: int
) -> Pairs:
    """What the block records of `photons` photons from `source_mm` that would interact in it if
    nothing were in their way (see `interacting_area_mm2`)."""
    energies = np.full(photons, energy_kev)
    return _record(rng, *_entering(rng, source_mm, energies), energies)


def from_around(rng: np.random.Generator, energies_kev: Floats) -> Pairs:
    """What the block records of photons from everywhere: room scatter, soil and sky."""
    photons = len(energies_kev)
    inside = rng.uniform(-0.5, 0.5, (photons, 3)) * BLOCK_MM
    ways = _unit(rng.normal(size=(photons, 3)))
    return _record(rng, inside, ways, energies_kev)


def interacting_area_mm2(energy_kev: float) -> float:
    """Compton interactions per photon and square millimetre of flux, block without self-shadow."""
    return float(BLOCK_MM.prod() * compton_per_mm(np.array([energy_kev]))[0])


def klein_nishina(rng: np.random.Generator, energies_kev: Floats) -> Floats:
    """A scattering cosine for each energy, by rejection under the Thomson envelope."""
    cosines = np.full(len(energies_kev), np.nan)
    open_ = np.arange(len(energies_kev))
    while len(open_):
        cosine = rng.uniform(-1, 1, len(open_))
        ratio = 1 / (1 + energies_kev[open_] / ELECTRON_KEV * (1 - cosine))
        density = ratio**2 * (ratio + 1 / ratio - 1 + cosine**2) / 2
        taken = rng.uniform(size=len(open_)) < density
        cosines[open_[taken]] = cosine[taken]
        open_ = open_[~taken]
    return cosines


def compton_per_mm(energies_kev: Floats) -> Floats:
    """Total Klein-Nishina attenuation of the block."""
    k = energies_kev / ELECTRON_KEV
    log = np.log(1 + 2 * k)
    total = (1 + k) / k**2 * (2 * (1 + k) / (1 + 2 * k) - log / k)
    total += log / (2 * k) - (1 + 3 * k) / (1 + 2 * k) ** 2
    return np.asarray(2 * np.pi * 0.7940788 * total * ELECTRONS_PER_MM)  # rₑ² = 0.794e-25 cm²


def photo_per_mm(energies_kev: Floats) -> Floats:
    """Photoelectric attenuation of the block."""
    return np.asarray(PHOTO_PER_MM * (energies_kev / 100) ** -2.9)


def _entering(
    rng: np.random.Generator, source_mm: Floats, energies: Floats
) -> tuple[Floats, Floats]:
    """First interaction points and directions of flight of photons from a point.

    Points are even in the block, then thinned by the attenuation on the way in; thinned ones are
    marked with NaN.
    """
    inside = rng.uniform(-0.5, 0.5, (len(energies), 3)) * BLOCK_MM
    ways = _unit(inside - source_mm)
    with np.errstate(divide="ignore"):
        depth = np.min((BLOCK_MM / 2 + np.sign(ways) * inside) / np.abs(ways), axis=1)
    mu = compton_per_mm(energies) + photo_per_mm(energies)
    inside[rng.uniform(size=len(energies)) > np.exp(-mu * depth)] = np.nan
    return inside, ways


def _record(rng: np.random.Generator, first: Floats, ways: Floats, energies: Floats) -> Pairs:
    """Scatter at `first`, fly on, absorb or scatter away; keep what is read out as two."""
    cosine = klein_nishina(rng, energies)
    scattered = _broadened(rng, energies, cosine)
    onward = _deflected(rng, ways, cosine)
    compton, photo = compton_per_mm(scattered), photo_per_mm(scattered)
    second = first + onward * rng.exponential(1 / (compton + photo))[:, None]
    absorbed = rng.uniform(size=len(energies)) < photo / (compton + photo)
    kept_energy = scattered / (1 + scattered / ELECTRON_KEV * (1 - klein_nishina(rng, scattered)))
    deposits = np.stack(
        (energies - scattered, np.where(absorbed, scattered, scattered - kept_energy)), axis=1
    )
    inside = np.all(np.abs(second) <= BLOCK_MM / 2, axis=1)  # NaN is outside
    apart = np.linalg.norm(second - first, axis=1) >= SEPARATION_MM
    seen = inside & apart & np.all(deposits >= THRESHOLD_KEV, axis=1)
    return _measured(rng, np.stack((first, second), axis=1)[seen], deposits[seen])


def _measured(rng: np.random.Generator, positions: Floats, energies: Floats) -> Pairs:
    """Blur, and hide which interaction came first."""
    sigma = ENERGY_FWHM_KEV / 2.3548 * np.sqrt(energies / 662.0)
    energies = energies + rng.normal(size=energies.shape) * sigma
    positions = positions + rng.normal(size=positions.shape) * POSITION_SIGMA_MM
    swapped = rng.uniform(size=len(energies)) < 0.5
    positions[swapped] = positions[swapped, ::-1]
    energies[swapped] = energies[swapped, ::-1]
    return Pairs(positions, energies)


def _broadened(rng: np.random.Generator, energies: Floats, cosine: Floats) -> Floats:
    """Scattered energies, spread by the motion of the electrons."""
    at_rest = energies / (1 + energies / ELECTRON_KEV * (1 - cosine))
    momentum = rng.standard_t(3, len(energies)) * MOMENTUM_SCALE
    transfer = np.sqrt(energies**2 + at_rest**2 - 2 * energies * at_rest * cosine)
    return np.asarray(np.clip(at_rest + momentum * transfer * at_rest / energies, 5, energies - 1))


def _deflected(rng: np.random.Generator, ways: Floats, cosine: Floats) -> Floats:
    """Directions at the scattering angle from `ways`, at any azimuth."""
    aside = _unit(np.cross(ways, rng.normal(size=ways.shape)))
    sine = np.sqrt(1 - cosine**2)
    return np.asarray(cosine[:, None] * ways + sine[:, None] * aside)


def _unit(vectors: Floats) -> Floats:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))

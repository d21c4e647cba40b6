"""Where the source is: the most likely direction of one point source, and how sure that is.

Events are a mixture of a point source (fraction f) and an even background, L = Π f K(event|s) +
(1−f)/4π. The sky picture gives the starts; expectation maximisation with a Gauss-Newton step on the
tangent plane climbs to the top; the robust ("sandwich") covariance of P. J. Huber, Proc. 5th
Berkeley Symp. 1 (1967) 221, there gives the uncertainty without trusting the assumed resolution.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nondum_compton_camera import imaging, sphere
from nondum_compton_camera.kinematics import Cones, Floats

_GRID = 1500
_PICTURED = 1000
"""More cones than these make a start no better, only slower and larger."""
_MLEM_ITERATIONS = 8
_STARTS = 3
_STEPS = 60
_STEP_LIMIT_RAD = 0.1
_CONVERGED_RAD = 1e-5
_PROBE_RAD = 0.005
_FLAT = 1 / (4 * np.pi)


@dataclass(frozen=True, slots=True)
class Estimate:
    """The direction of the source in the instrument's frame."""

    direction: tuple[float, float, float]
    """Unit vector."""
    sigma_rad: float
    """Standard error along the worse axis; infinite where the data do not settle one."""
    fraction: float
    """Of the events, how many came from the source."""
    gain: float
    """Log-likelihood above "no source at all"; under 12 or so it may be chance."""
    events: int


@dataclass(frozen=True, slots=True)
class _Top:
    direction: Floats
    fraction: float
    gain: float


def locate(cones: Cones) -> Estimate | None:
    """The most likely source direction; None without any cone."""
    if not len(cones):
        return None
    top = max((_climb(cones, start) for start in _starts(cones)), key=lambda top: top.gain)
    return Estimate(
        direction=(float(top.direction[0]), float(top.direction[1]), float(top.direction[2])),
        sigma_rad=_sigma(cones, top),
        fraction=top.fraction,
        gain=top.gain,
        events=len(cones),
    )


def _starts(cones: Cones) -> list[Floats]:
    directions = sphere.grid(_GRID)
    rows = imaging.response(cones.thinned(_PICTURED), directions)
    picture = imaging.sharpened(rows, imaging.back_projection(rows), _MLEM_ITERATIONS)
    return imaging.peaks(picture, directions, count=_STARTS, apart_rad=0.3)


def _climb(cones: Cones, start: Floats) -> _Top:
    """Expectation maximisation from `start` to the top nearest to it."""
    direction, fraction = start, 0.5
    for _ in range(_STEPS):
        density, residuals, slopes, basis = _linearised(cones, direction)
        likelihood = fraction * density.sum(axis=1)
        mine = likelihood / (likelihood + (1 - fraction) * _FLAT)
        fraction = float(np.clip(mine.mean(), 1e-3, 1 - 1e-3))
        step = _step(_shares(density, mine), residuals, slopes, cones.sigmas)
        direction = sphere.moved(direction, basis, step)
        if np.linalg.norm(step) < _CONVERGED_RAD:
            break
    return _Top(direction, fraction, float(_gains(cones, direction, fraction).sum()))


def _linearised(cones: Cones, direction: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Density, angular residual and its slope on the tangent plane, for each event and order."""
    basis = sphere.tangent(direction)
    cosine = np.clip(cones.axes @ direction, -1, 1)
    angles = np.arccos(cosine)
    sine = np.maximum(np.sqrt(1 - cosine**2), 1e-3)
    slopes = -(cones.axes @ basis.T) / sine[..., None]
    residuals = cones.angles - angles
    profile = np.exp(-0.5 * (residuals / cones.sigmas) ** 2)
    density = profile / ((2 * np.pi) ** 1.5 * cones.sigmas * np.sin(cones.angles))
    return cones.weights * density, residuals, slopes, basis


def _shares(density: Floats, mine: Floats) -> Floats:
    """How much of each event and order is the source's."""
    total = np.maximum(density.sum(axis=1, keepdims=True), np.finfo(float).tiny)
    return np.asarray(density / total * mine[:, None])


def _step(shares: Floats, residuals: Floats, slopes: Floats, sigmas: Floats) -> Floats:
    precision = shares / sigmas**2
    matrix = np.einsum("no,noi,noj->ij", precision, slopes, slopes) + 1e-9 * np.eye(2)
    vector = np.einsum("no,noi,no->i", precision, slopes, residuals)
    step = np.linalg.solve(matrix, vector)
    return np.asarray(step * min(1.0, _STEP_LIMIT_RAD / max(float(np.linalg.norm(step)), 1e-12)))


def _gains(cones: Cones, direction: Floats, fraction: float) -> Floats:
    """Each event's log-likelihood above "no source"."""
    density = _linearised(cones, direction)[0].sum(axis=1)
    return np.asarray(np.log(fraction * density / _FLAT + 1 - fraction))


def _sigma(cones: Cones, top: _Top) -> float:
    """Standard error by the sandwich H⁻¹ B H⁻¹, curvature and scores by central differences."""
    basis = sphere.tangent(top.direction)

    def gains(i: float, j: float) -> Floats:
        there = sphere.moved(top.direction, basis, _PROBE_RAD * np.array((i, j)))
        return _gains(cones, there, top.fraction)

    here, east, west, north, south = (gains(*p) for p in ((0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)))
    cross = (gains(1, 1) + gains(-1, -1) - gains(1, -1) - gains(-1, 1)).sum() / 4
    curvature = np.array(
        (
            ((east + west - 2 * here).sum(), cross),
            (cross, (north + south - 2 * here).sum()),
        )
    )
    scores = np.stack((east - west, north - south)) / 2
    if np.linalg.eigvalsh(curvature)[-1] >= 0:
        return float("inf")
    bread = np.linalg.inv(curvature)
    covariance = bread @ (scores @ scores.T) @ bread * _PROBE_RAD**2
    return float(np.sqrt(np.linalg.eigvalsh(covariance)[-1]))

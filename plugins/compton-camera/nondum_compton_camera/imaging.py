"""Pictures of the whole sky from cones: simple back-projection, then list-mode MLEM.

Back-projection: S. J. Wilderman et al., IEEE Trans. Nucl. Sci. 45 (1998) 957, who also give the
list-mode maximum-likelihood expectation maximisation (H. H. Barrett, T. White, L. C. Parra, J. Opt.
Soc. Am. A 14 (1997) 2914) for scatter cameras. Far field: all cones have their apex at the centre.
"""

from __future__ import annotations

import numpy as np

from nondum_compton_camera.kinematics import Cones, Floats

_CHUNK = 256


def response(cones: Cones, directions: Floats) -> Floats:
    """(N, M): density per steradian of event n, given a source in direction m.

    Each order of an event spreads its weight over a ring with a Gaussian profile whose integral
    over the sphere is 1 where the ring is narrow: (2π)^{3/2} σ sin θ.
    """
    rows = [_rows(cones, directions, slice(n, n + _CHUNK)) for n in range(0, len(cones), _CHUNK)]
    return np.concatenate(rows) if rows else np.zeros((0, len(directions)))


def back_projection(rows: Floats) -> Floats:
    """The sum of all cones: a blurred picture that has its peak near the source."""
    return np.asarray(rows.sum(axis=0))


def sharpened(rows: Floats, picture: Floats, iterations: int) -> Floats:
    """`picture` after that many MLEM iterations, for even sensitivity over the sphere.

    A small floor keeps events that fit nowhere in the picture (background) from pulling at it.
    """
    floor = 0.05 * float(rows.mean()) * float(picture.sum())
    for _ in range(iterations):
        expected = rows @ picture + floor
        picture = picture * (rows.T @ (1 / expected))
        picture *= len(rows) / picture.sum()
    return picture


def peaks(picture: Floats, directions: Floats, *, count: int, apart_rad: float) -> list[Floats]:
    """The brightest directions, brightest first, none nearer than `apart_rad` to another."""
    left = picture.copy()
    found: list[Floats] = []
    while len(found) < count and left.max() > 0:
        best = directions[int(np.argmax(left))]
        found.append(best)
        left[directions @ best > np.cos(apart_rad)] = 0
    return found


def _rows(cones: Cones, directions: Floats, part: slice) -> Floats:
    angles = np.arccos(np.clip(cones.axes[part] @ directions.T, -1, 1))
    theta, sigma = cones.angles[part, :, None], cones.sigmas[part, :, None]
    profile = np.exp(-0.5 * ((angles - theta) / sigma) ** 2)
    density = profile / ((2 * np.pi) ** 1.5 * sigma * np.sin(theta))
    return np.asarray((cones.weights[part, :, None] * density).sum(axis=1))

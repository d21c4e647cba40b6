"""What every test of this plugin may ask for."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest
from line_bench import Camera

from nondum_compton_camera.kinematics import Cones

MakeSky = Callable[..., Cones]


@pytest.fixture
def camera() -> Iterator[Camera]:
    on_table = Camera()
    yield on_table
    on_table.close()


@pytest.fixture(scope="session")
def sky() -> MakeSky:
    """Makes cones of a source, exactly as thick as they say, and cones of an even background."""

    def make(
        rng: np.random.Generator, source: np.ndarray, *, cones: int, background: int = 0
    ) -> Cones:
        total = cones + background
        axes = rng.normal(size=(total, 3))
        axes /= np.linalg.norm(axes, axis=1, keepdims=True)
        sigmas = rng.uniform(0.05, 0.12, total)
        angles = np.arccos(axes @ source) + rng.normal(size=total) * sigmas
        angles[cones:] = np.arccos(rng.uniform(-0.8, 0.9, background))
        kept = (angles > 0.15) & (angles < 2.7)
        both = np.stack((axes, -axes), axis=1)
        weights = np.tile((1.0, 0.0), (total, 1))
        return Cones(
            both[kept],
            np.stack((angles, angles), axis=1)[kept],
            np.stack((sigmas, sigmas), axis=1)[kept],
            weights[kept],
        )

    return make

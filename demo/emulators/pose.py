"""Rigid poses of the simulated world; roll, pitch, yaw about fixed axes x, y, z (REP-103)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def rotation(rpy: Sequence[float]) -> Floats:
    """The matrix that turns vectors of a frame with this attitude into its parent's.

    >>> bool(np.allclose(rotation((0, 0, np.pi / 2)) @ (1, 0, 0), (0, 1, 0)))
    True
    """
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    return np.array(
        (
            (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
            (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
            (-sp, cp * sr, cp * cr),
        )
    )


@dataclass(frozen=True, slots=True)
class Mount:
    """Where an instrument sits on the body: metres and radians."""

    xyz: tuple[float, float, float]
    rpy: tuple[float, float, float]

    def to_body(self, vector: Floats) -> Floats:
        """A direction of the instrument's frame, in the body's."""
        return np.asarray(rotation(self.rpy) @ vector)

    def seen(self, point: Sequence[float]) -> Floats:
        """A point of the body frame (m), in the instrument's frame (m)."""
        return np.asarray(rotation(self.rpy).T @ (np.asarray(point) - np.asarray(self.xyz)))

"""Directions: an even grid of them over the sphere, and the flat plane that touches it at one."""

from __future__ import annotations

import numpy as np

from nondum_compton_camera.kinematics import Floats


def grid(count: int) -> Floats:
    """`count` unit vectors spread evenly: the Fibonacci lattice of Á. González, Math. Geosci. 42
    (2010) 49. Neighbours lie about 3.5/√count rad apart.

    >>> grid(1000).shape
    (1000, 3)
    """
    index = np.arange(count) + 0.5
    z = 1 - 2 * index / count
    azimuth = np.pi * (1 + np.sqrt(5)) * index
    radius = np.sqrt(1 - z * z)
    return np.stack((radius * np.cos(azimuth), radius * np.sin(azimuth), z), axis=1)


def tangent(direction: Floats) -> Floats:
    """Two orthonormal rows that span the plane touching the sphere at `direction`."""
    aside = np.eye(3)[np.argmin(np.abs(direction))]
    first = np.cross(direction, aside)
    first /= np.linalg.norm(first)
    return np.stack((first, np.cross(direction, first)))


def moved(direction: Floats, basis: Floats, step: Floats) -> Floats:
    """`direction` after a small `step` (rad, along the rows of `basis`)."""
    there = direction + step @ basis
    return np.asarray(there / np.linalg.norm(there))


def angle(one: Floats, other: Floats) -> float:
    """Between two unit vectors, rad; exact for small ones too."""
    return float(2 * np.arcsin(min(1.0, float(np.linalg.norm(one - other)) / 2)))

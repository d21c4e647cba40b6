"""Which of many windows mean somebody: the surest of each heap, at the heap's mean place.

A window is left out when a surer one shares enough of the smaller of both (Dollár, Belongie and
Perona, "The fastest pedestrian detector in the west", BMVC 2010); the rest vote on where it is.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

Floats: TypeAlias = npt.NDArray[np.float64]

_VOTES = 0.5
"""Intersection over union from which on a window has a vote."""


def people(windows: Floats, scores: Floats, overlap: float) -> tuple[Floats, Floats]:
    """One window and its score for each person, surest first.

    `windows` are N × (left, top, width, height), `scores` N positive numbers; `overlap` is the
    share of the smaller window, 0 to 1, from which on two mean the same person.
    """
    order = np.argsort(-scores, kind="stable")
    windows, scores = windows[order], scores[order]
    shared = _shared(windows)
    areas = windows[:, 2] * windows[:, 3]
    same = shared > overlap * np.minimum.outer(areas, areas)
    kept: list[int] = []
    for index in range(len(windows)):
        if not same[index, kept].any():
            kept.append(index)
    votes = (shared > _VOTES * (np.add.outer(areas, areas) - shared))[kept] * scores
    return votes @ windows / votes.sum(axis=1, keepdims=True), scores[kept]


def _shared(windows: Floats) -> Floats:
    """The area that each two windows share."""
    left_top, right_bottom = windows[:, :2], windows[:, :2] + windows[:, 2:]
    begin = np.maximum(left_top[:, None], left_top)
    end = np.minimum(right_bottom[:, None], right_bottom)
    return np.asarray(np.prod(np.clip(end - begin, 0.0, None), axis=2))

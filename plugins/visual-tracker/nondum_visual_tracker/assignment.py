"""Who is who: the cheapest one-to-one assignment of tracks to sightings.

Kuhn-Munkres with potentials, O(n³), for a handful of people. All tracks are assigned together,
so that two people side by side keep their order even when every prediction is off the same way;
nearest-neighbour matching would swap them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence


def assigned(cost: Sequence[Sequence[float]], *, gate: float) -> dict[int, int]:
    """Row → column of the cheapest assignment; a pair dearer than `gate` stays apart.

    >>> assigned([[1.0, 16.0], [4.0, 1.0]], gate=9.0)
    {0: 0, 1: 1}
    >>> assigned([[50.0]], gate=9.0)
    {}
    """
    rows, columns = len(cost), len(cost[0]) if cost else 0
    # One dummy column per row: staying unassigned costs the gate.
    padded = [
        [*row, *(gate if own == other else math.inf for other in range(rows))]
        for own, row in enumerate(cost)
    ]
    pairs = _cheapest(padded)
    return {row: column for row, column in sorted(pairs.items()) if column < columns}


def _cheapest(cost: list[list[float]]) -> dict[int, int]:
    rows, columns = len(cost), len(cost[0]) if cost else 0
    row_potential, column_potential = [0.0] * (rows + 1), [0.0] * (columns + 1)
    row_of = [0] * (columns + 1)  # 1-based; 0: free
    for row in range(1, rows + 1):
        row_of[0] = row
        _augment(cost, row_of, row_potential, column_potential)
    return {row_of[column] - 1: column - 1 for column in range(1, columns + 1) if row_of[column]}


def _augment(
    cost: list[list[float]], row_of: list[int], u: list[float], v: list[float]
) -> None:  # fmt: skip
    """Grow the assignment by the row at `row_of[0]`, along a cheapest augmenting path."""
    columns = len(row_of) - 1
    slack, came_from = [math.inf] * (columns + 1), [0] * (columns + 1)
    used = [False] * (columns + 1)
    at = 0
    while row_of[at]:
        used[at] = True
        row = row_of[at]
        free = [column for column in range(1, columns + 1) if not used[column]]
        for column in free:
            reduced = cost[row - 1][column - 1] - u[row] - v[column]
            if reduced < slack[column]:
                slack[column], came_from[column] = reduced, at
        nearest = min(free, key=lambda column: slack[column])
        step = slack[nearest]
        for column in range(columns + 1):
            if used[column]:
                u[row_of[column]] += step
                v[column] -= step
            else:
                slack[column] -= step
        at = nearest
    while at:
        row_of[at], at = row_of[came_from[at]], came_from[at]

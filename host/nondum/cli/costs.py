"""What people are told of a payload's size: which kind of host takes how much of the drive."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from nondum.cli import render
from nondum.wheelhouse.build.cost import LARGE_BYTES, Cost
from nondum.wheelhouse.format.contents import Contents


def row(cost: Cost) -> dict[str, Any]:
    """A target's cost for programs."""
    return {
        "arch": cost.target.architecture,
        "python": cost.target.python,
        "bytes": cost.all_bytes,
        "own_bytes": cost.own_bytes,
    }


def remark(listed: Contents, costs: Sequence[Cost]) -> str:
    """Which targets of a large payload could be left out, and what that saves; else nothing."""
    if listed.total_bytes < LARGE_BYTES or len(costs) < 2:
        return ""
    own = [
        f"{render.size(cost.own_bytes)} for {cost.target.architecture} with Python "
        f"{cost.target.python} alone"
        for cost in costs
    ]
    shared = listed.total_bytes - sum(cost.own_bytes for cost in costs)
    shares = ", ".join((*own, f"{render.size(shared)} for several"))
    size = render.size(listed.total_bytes)
    return f"{listed.payload_id} takes {size}: {shares}; --arch and --python name fewer"

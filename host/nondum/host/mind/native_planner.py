"""nondum's own search as a planner like any other: `nondum.planning.search`, and a clock."""

from __future__ import annotations

import gc
import time
from typing import ClassVar

from nondum.planning.search import solve
from nondum.sdk.planner import (
    CONDITIONAL_EFFECTS,
    DERIVED_PREDICATES,
    Answer,
    GaveUp,
    GroundTask,
)


class NativePlanner:
    """Complete, and without a wish for anything but the standard library."""

    speaks: ClassVar[str] = "ground"
    handles: ClassVar[frozenset[str]] = frozenset({CONDITIONAL_EFFECTS, DERIVED_PREDICATES})

    def plan(self, task: GroundTask, deadline_s: float) -> Answer:
        """Search for at most about `deadline_s` seconds."""
        until_s = time.monotonic() + deadline_s
        gc.disable()  # millions of states, and no cycle in them: a full collection takes a second
        try:
            answer = solve(task, lambda: time.monotonic() > until_s)
        finally:
            gc.enable()
        if isinstance(answer, GaveUp):
            return GaveUp(f"no plan within {round(deadline_s, 1):g} s")
        return answer

"""nondum's own planner: a ground task in, a typed answer out. It has no clock; it asks."""

from nondum.planning.search.strategy import IsOver, solve

__all__ = ["IsOver", "solve"]

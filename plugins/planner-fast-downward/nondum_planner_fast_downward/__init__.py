"""Fast Downward, run as a program, as a planner of nondum."""

from nondum_planner_fast_downward.planner import FastDownwardPlanner

__all__ = ["FastDownwardPlanner"]

"""pyperplan's greedy best-first search with the FF heuristic, as a planner of nondum."""

from nondum_planner_pyperplan.planner import PyperplanPlanner

__all__ = ["PyperplanPlanner"]

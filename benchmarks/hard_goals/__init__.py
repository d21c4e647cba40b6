"""Goals that are too much for any planner."""

"""nondum's own planner: ground tasks in, typed answers out."""

"""From a merged domain, facts and a goal to a ground task."""

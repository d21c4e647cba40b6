"""Tools for PDDL files that are no fragments."""

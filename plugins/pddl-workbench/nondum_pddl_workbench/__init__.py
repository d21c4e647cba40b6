"""PDDL files without a host: `nondum pddl`, and what it is made of."""

"""PDDL text: its syntax, its parser, conditions and types."""

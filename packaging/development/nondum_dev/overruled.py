"""Packages of which nondum needs other versions than somebody else here asks for."""

from __future__ import annotations

OVERRIDING = ("lark>=1.2",)
"""Of these, what is written here is locked, whatever others ask for."""
OVERRULED = frozenset({"pddl"})
"""Who asks for other versions of those, and works with these. They are installed beside the
environment, in which everybody has what they ask for then."""

"""nondum-core: the one versioned fragment whose words every plugin may use."""

from __future__ import annotations

from functools import lru_cache
from importlib import resources
from typing import cast

from nondum.planning.merge.domain import Origin, Predicate
from nondum.planning.pddl.parse import parse_fragment
from nondum.planning.pddl.syntax import DomainFragment
from nondum.planning.pddl.typegraph import TypeGraph

CORE_NAME = "nondum-core"
CORE_VERSION = "1"

HOST_PREDICATES = frozenset({"self", "on", "ready", "idle", "output", "free"})
"""Written by the host alone; plugins read them."""

TAKEN_PREDICATES = frozenset({"idle", "free"})
"""What a lasting action may delete: the resources that it takes while it runs."""


@lru_cache(maxsize=1)
def core() -> DomainFragment:
    """The core vocabulary, parsed."""
    file = f"{CORE_NAME}.pddl"
    text = (resources.files(__package__) / file).read_text(encoding="utf-8")
    return cast(DomainFragment, parse_fragment(text, file))


@lru_cache(maxsize=1)
def core_graph() -> TypeGraph:
    """The core's types."""
    return TypeGraph({declared.name: frozenset(declared.types) for declared in core().types})


@lru_cache(maxsize=1)
def core_predicates() -> dict[str, Predicate]:
    """The core's predicates by name."""
    valued = {name.name: name.types for name in core().valued}
    return {
        declared.name: Predicate.declared(
            declared,
            Origin("", CORE_NAME, CORE_VERSION, declared.place),
            valued=declared.name in valued,
            value_type=" ".join(valued.get(declared.name, ())),
        )
        for declared in core().predicates
    }


@lru_cache(maxsize=1)
def core_value_types() -> dict[str, str]:
    """The types of message that the values of the core's facts are."""
    return {name: p.value_type for name, p in core_predicates().items() if p.value_type}

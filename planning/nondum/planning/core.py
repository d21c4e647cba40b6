"""nondum-core: the one versioned fragment whose words every plugin may use."""

from __future__ import annotations

from functools import lru_cache
from importlib import resources
from typing import cast

from nondum.planning.domain import Origin, Predicate
from nondum.planning.parse import parse_fragment
from nondum.planning.syntax import DomainFragment
from nondum.planning.typegraph import TypeGraph

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
    text = (resources.files("nondum.planning") / file).read_text(encoding="utf-8")
    return cast(DomainFragment, parse_fragment(text, file))


@lru_cache(maxsize=1)
def core_graph() -> TypeGraph:
    """The core's types."""
    return TypeGraph({declared.name: frozenset(declared.types) for declared in core().types})


@lru_cache(maxsize=1)
def core_predicates() -> dict[str, Predicate]:
    """The core's predicates by name."""
    valued = {name.name for name in core().valued}
    return {
        declared.name: Predicate.declared(
            declared,
            Origin("", CORE_NAME, CORE_VERSION, declared.place),
            valued=declared.name in valued,
        )
        for declared in core().predicates
    }

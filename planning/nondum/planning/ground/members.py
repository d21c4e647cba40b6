"""Which objects are of a type."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping

from nondum.planning.merge.domain import Merged
from nondum.planning.pddl.syntax import TypedName
from nondum.planning.pddl.typegraph import ROOT

Types = Mapping[str, tuple[str, ...]]
"""Object → its types."""


def members_of(merged: Merged, types: Types) -> dict[str, frozenset[str]]:
    """Type → the objects of it; `types` are the types of every object."""
    members: defaultdict[str, set[str]] = defaultdict(set)
    above: dict[str, frozenset[str]] = {}
    for name, of in types.items():
        for type_ in of:
            if type_ not in above:
                above[type_] = frozenset(merged.domain.types.ancestors(type_))
            for ancestor in above[type_]:
                members[ancestor].add(name)
    return {type_: frozenset(names) for type_, names in members.items()}


def domains_of(
    variables: Iterable[TypedName], members: Mapping[str, frozenset[str]]
) -> dict[str, frozenset[str]]:
    """Variable → the objects that it may stand for."""
    return {
        variable.name: frozenset().union(
            *(members.get(type_, ()) for type_ in variable.types or (ROOT,))
        )
        for variable in variables
    }

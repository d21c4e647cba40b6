"""What a plugin's own types are kinds of, by its own fragments: before anything is merged."""

from __future__ import annotations

from collections.abc import Callable

from nondum.planning.merge.core import core_graph
from nondum.planning.pddl.parse import parse_fragment
from nondum.planning.pddl.syntax import DomainFragment
from nondum.planning.pddl.typegraph import TypeGraph
from nondum.sdk.description import PluginDescription
from nondum.sdk.errors import FragmentRefused


def kinds_of(description: PluginDescription) -> Callable[[str], frozenset[str]]:
    """Give a function: type → itself and all types above it, as the plugin declares them.

    Fragments are read only where a unit of the plugin has a type that it declares; one that cannot
    be read declares nothing (planning tells what is wrong with it).
    """
    graph = core_graph()
    types = {unit.type for unit in description.units}
    types |= {output.of for unit in description.units for output in unit.outputs if output.of}
    if all(type_ in graph for type_ in types):
        return graph.ancestors
    return _extended(graph, description).ancestors


def _extended(graph: TypeGraph, description: PluginDescription) -> TypeGraph:
    parents: dict[str, frozenset[str]] = {}
    for fragment in description.fragments:
        try:
            parsed = parse_fragment(fragment.text, fragment.name)
        except FragmentRefused:
            continue
        if isinstance(parsed, DomainFragment):
            for declared in parsed.types:
                known = parents.get(declared.name, frozenset())
                parents[declared.name] = known | frozenset(declared.types)
    own = {name: above for name, above in parents.items() if name not in graph}
    return graph.with_parents(own)

"""Types as a tree, for planners that know one parent of a type and one type of an object."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from nondum.planning.pddl.typegraph import ROOT, TypeGraph, types_or_root


class TypeTree:
    """The types of a domain, each with one of its parents, and every object with one of its types.

    Which types say less in the tree than they mean depends on the objects there are.
    """

    def __init__(self, graph: TypeGraph, objects: Mapping[str, tuple[str, ...]]) -> None:
        """`objects` are all there are, with their types."""
        self._graph = graph
        self._paths: dict[str, tuple[str, ...]] = {ROOT: (ROOT,)}
        lost = {t for name in graph.parents for t in graph.ancestors(name) - {*self._path(name)}}
        self.objects = {name: self._one_of(types) for name, types in objects.items()}
        """Object → the one type that says most about it."""
        for name, types in objects.items():
            meant = frozenset().union(*map(graph.ancestors, types))
            lost |= meant - {*self._path(self.objects[name])}
        self._lost = frozenset(lost)

    @property
    def is_whole(self) -> bool:
        """Whether it says all that the types mean."""
        return not self._lost

    def edges(self) -> tuple[tuple[str, str], ...]:
        """Type and parent, in order; `object` is the parent of those at the top."""
        return tuple((name, path[1]) for name, path in sorted(self._paths.items()) if path[1:])

    def declared(self, types: Iterable[str]) -> tuple[str, tuple[str, ...]]:
        """How to declare something of one of `types`: a type of the tree, and the types that it
        must be one of besides; none where the first says it all."""
        wanted = self._widest(types_or_root(tuple(types)))
        if len(wanted) == 1 and wanted[0] not in self._lost:
            return wanted[0], ()
        return ROOT, wanted

    def _widest(self, types: tuple[str, ...]) -> tuple[str, ...]:
        """Without those that are kinds of others."""
        above = self._graph.is_kind_of
        names = sorted(set(types))
        return tuple(n for n in names if not any(o != n and above(n, o) for o in names))

    def _one_of(self, types: Iterable[str]) -> str:
        return max(types, key=lambda name: (len(self._path(name)), name), default=ROOT)

    def _path(self, name: str) -> tuple[str, ...]:
        """The type and those above it, along the parents with the longest way up."""
        if name not in self._paths:
            parents = sorted(self._graph.parents.get(name, ()))
            above = max(map(self._path, parents), key=len, default=(ROOT,))
            self._paths[name] = (name, *above)
        return self._paths[name]

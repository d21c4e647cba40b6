"""Types and their parents: who is a kind of what. A type may have several parents."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

ROOT = "object"
"""The type of everything."""


def types_or_root(types: tuple[str, ...]) -> tuple[str, ...]:
    """The types claimed, or `object` where none were."""
    return types or (ROOT,)


@dataclass(frozen=True)
class TypeGraph:
    """Immutable. Types without a declared parent are directly under `object`."""

    parents: Mapping[str, frozenset[str]]
    _ancestors: dict[str, frozenset[str]] = field(default_factory=dict, compare=False, repr=False)

    def __contains__(self, name: str) -> bool:
        return name == ROOT or name in self.parents

    def with_parents(self, parents: Mapping[str, frozenset[str]]) -> TypeGraph:
        """The graph with these types added or replaced."""
        return TypeGraph({**self.parents, **parents})

    def ancestors(self, name: str) -> frozenset[str]:
        """The type itself and all above it."""
        if name not in self._ancestors:
            found, waiting = {name, ROOT}, [name]
            while waiting:
                new = self.parents.get(waiting.pop(), frozenset()) - found
                found |= new
                waiting += new
            self._ancestors[name] = frozenset(found)
        return self._ancestors[name]

    def is_kind_of(self, name: str, other: str) -> bool:
        """Whether every `name` is also an `other`."""
        return other in self.ancestors(name)

    def all_kind_of(self, names: Iterable[str], others: Iterable[str]) -> bool:
        """Whether whatever is one of `names` is also one of `others` (both mean `either`)."""
        wanted = frozenset(others)
        return all(not wanted.isdisjoint(self.ancestors(name)) for name in names)

    def is_one_of(self, types: Iterable[str], wanted: Iterable[str]) -> bool:
        """Whether an object of all `types` is one of `wanted`."""
        names = frozenset(wanted)
        return any(not names.isdisjoint(self.ancestors(type_)) for type_ in types)

    def comparable(self, names: Iterable[str], others: Iterable[str]) -> bool:
        """Whether one of the two is a kind of the other."""
        left, right = tuple(names), tuple(others)
        return self.all_kind_of(left, right) or self.all_kind_of(right, left)

    def may_be(self, names: Iterable[str], others: Iterable[str]) -> bool:
        """Whether something of `names` can be one of `others`: some pair of them is comparable."""
        right = tuple(others)
        return any(self.comparable((name,), (other,)) for name in names for other in right)

    def cycle(self, starts: Iterable[str] | None = None) -> tuple[str, ...]:
        """The types of one cycle, each a kind of the next; empty if there is none.

        With `starts`, only cycles are looked for that lead on from one of them.
        """
        finished: set[str] = set()
        for start in sorted(self.parents if starts is None else starts):
            found = self._cycle_from(start, finished)
            if found:
                return found
        return ()

    def _cycle_from(self, start: str, finished: set[str]) -> tuple[str, ...]:
        path: dict[str, None] = {}
        waiting = [(start, False)]
        while waiting:
            name, is_done = waiting.pop()
            if is_done:
                del path[name]
                finished.add(name)
            elif name in path:
                names = list(path)
                return tuple(names[names.index(name) :])
            elif name not in finished:
                path[name] = None
                waiting.append((name, True))
                waiting += ((p, False) for p in sorted(self.parents.get(name, ())))
        return ()

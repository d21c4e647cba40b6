"""Joins prepared once for each condition, so that one more component costs its own only."""

from __future__ import annotations

from functools import lru_cache
from typing import Generic, TypeVar

from nondum.planning.ground.join import Domains, Join, Query
from nondum.planning.ground.matching import Pattern
from nondum.planning.pddl.flat import Flat, flat
from nondum.planning.pddl.normal import Condition
from nondum.planning.pddl.syntax import TypedName

_T = TypeVar("_T")

_KEPT = 8192


class _Same(Generic[_T]):
    """Something that is equal to itself only; saves comparing conditions part by part."""

    __slots__ = ("value",)

    def __init__(self, value: _T) -> None:
        self.value = value

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Same) and self.value is other.value

    def __hash__(self) -> int:
        return id(self.value)


def flattened(variables: tuple[TypedName, ...], *conditions: Condition) -> Flat:
    """`flat`, done once for the same conditions."""
    return _flattened(variables, *map(_Same, conditions))


@lru_cache(maxsize=_KEPT)
def _flattened(variables: tuple[TypedName, ...], *conditions: _Same[Condition]) -> Flat:
    return flat(variables, *(condition.value for condition in conditions))


def joins_of(
    found: Flat, domains: Domains, growing: frozenset[str]
) -> tuple[tuple[str, Join], ...]:
    """The joins of a condition, each with the predicate that triggers it; empty: it runs once.

    `domains` are the objects of each variable: how many there are when a condition is first met
    decides in which order it is joined. Facts of predicates that are not in `growing` are all there
    from the beginning.
    """
    at = tuple(i for i, atom in enumerate(found.positive) if atom.predicate in growing)
    key = (_Same(found), at)
    if key not in _prepared:
        if len(_prepared) == _KEPT:
            _prepared.clear()
        _prepared[key] = _joins(found, domains, at)
    return _prepared[key]


_prepared: dict[tuple[_Same[Flat], tuple[int, ...]], tuple[tuple[str, Join], ...]] = {}


def _joins(found: Flat, domains: Domains, growing: tuple[int, ...]) -> tuple[tuple[str, Join], ...]:
    names = tuple(variable.name for variable in found.variables)
    query = Query(
        variables=names,
        breadths={name: len(domain) for name, domain in zip(names, domains, strict=True)},
        patterns=tuple(map(Pattern.of, found.positive)),
        equal=tuple((pair.left.name, pair.right.name) for pair in found.equal),
        unequal=tuple((pair.left.name, pair.right.name) for pair in found.unequal),
    )
    if not growing:
        return (("", Join(query)),)
    return tuple((found.positive[index].predicate, Join(query, index)) for index in growing)

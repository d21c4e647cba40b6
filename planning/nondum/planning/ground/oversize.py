"""Leaving out the components that make a task too big to write out, so that the rest goes on."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Generic, TypeVar

from nondum.planning.ground.bounds import TooManyBindings
from nondum.planning.merge.contribution import Contribution
from nondum.planning.merge.domain import Merged
from nondum.planning.merge.merge import merge
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen

_T = TypeVar("_T")


@frozen
class Fitted(Generic[_T]):
    """What could be made of a domain once it was small enough."""

    made: _T
    merged: Merged
    """Without the components that were left out."""
    left_out: Mapping[str, Problem]
    """Component → what it has too much of."""


def fitted(
    contributions: Iterable[Contribution],
    merged: Merged,
    make: Callable[[Merged], _T],
    left_out: Mapping[str, Problem] | None = None,
) -> Fitted[_T]:
    """Make something of a merge. As often as needed, leave out the component that brought what is
    widest in it; then let in again those that are not the cause.

    `merged` is the merge of all `contributions`; `left_out` were left out before, and stay out.
    Raises `TooManyBindings` where no component can be left out, and all else that `make` raises.
    """
    return _Fitting(tuple(contributions), merged.self_host, make).of(merged, dict(left_out or {}))


class _Fitting(Generic[_T]):
    def __init__(
        self,
        contributions: tuple[Contribution, ...],
        self_host: str,
        make: Callable[[Merged], _T],
    ) -> None:
        self._contributions = contributions
        self._self_host = self_host
        self._make = make

    def of(self, merged: Merged, before: dict[str, Problem]) -> Fitted[_T]:
        left_out = dict(before)
        found = self._without(left_out) if left_out else merged
        while True:
            try:
                made = self._make(found)
                break
            except TooManyBindings as refused:
                blamed = refused.components - left_out.keys()
                if not blamed:
                    raise
                left_out |= dict.fromkeys(sorted(blamed), refused.problems[0])
                found = self._without(left_out)
        fit = Fitted(made, found, left_out)
        for component in [name for name in left_out if name not in before][:-1]:
            fit = self._with(component, fit)
        return fit

    def _with(self, component: str, fit: Fitted[_T]) -> Fitted[_T]:
        """What was widest while another was in may be small enough without it."""
        fewer = {name: problem for name, problem in fit.left_out.items() if name != component}
        found = self._without(fewer)
        try:
            return Fitted(self._make(found), found, fewer)
        except TooManyBindings:
            return fit

    def _without(self, left_out: Mapping[str, Problem]) -> Merged:
        kept = (c for c in self._contributions if c.component not in left_out)
        return merge(kept, self._self_host)

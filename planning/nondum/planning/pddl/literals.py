"""Conjunctions of facts that must hold and facts that must not, by number."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Literals:
    """All of `positive` hold and none of `negative`."""

    positive: frozenset[int] = frozenset()
    negative: frozenset[int] = frozenset()

    def __or__(self, other: Literals) -> Literals:
        return Literals(self.positive | other.positive, self.negative | other.negative)

    def __le__(self, other: Literals) -> bool:
        return self.positive <= other.positive and self.negative <= other.negative

    @property
    def is_possible(self) -> bool:
        """Whether it does not contradict itself."""
        return not self.positive & self.negative

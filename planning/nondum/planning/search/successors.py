"""Which moves can be made in a state: a tree of their preconditions.

Source: Helmert 2006, successor generators; here a trie, since facts are no variables with values.
"""

from __future__ import annotations

from collections import Counter

from nondum.planning.search.changes import bits_of
from nondum.planning.search.encoding import Encoded, State


class _Branch:
    __slots__ = ("below", "moves", "tested")

    def __init__(self) -> None:
        self.moves: list[int] = []
        self.tested = 0
        self.below: dict[int, _Branch] = {}


class Successors:
    """Finds the applicable moves of one task."""

    def __init__(self, encoded: Encoded) -> None:
        needs = [tuple(bits_of(move.precondition)) for move in encoded.moves]
        uses = Counter(bit for bits in needs for bit in bits)
        self._root = _Branch()
        for index, bits in enumerate(needs):
            branch = self._root
            for bit in sorted(bits, key=lambda bit: (-uses[bit], bit)):
                branch.tested |= 1 << bit
                branch = branch.below.setdefault(1 << bit, _Branch())
            branch.moves.append(index)

    def of(self, state: State) -> list[int]:
        """The moves that can be made."""
        found: list[int] = []
        waiting = [self._root]
        for branch in waiting:
            found += branch.moves
            hit = branch.tested & state
            while hit:
                low = hit & -hit
                waiting.append(branch.below[low])
                hit ^= low
        return found

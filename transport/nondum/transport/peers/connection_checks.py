"""Which connections are looked at for a message that does not end. Pure.

A look takes some 30 µs: a host with a hundred peers that looked at all of them ten times a second
would do little else. But what such a message fills is memory. So once this process has more of it,
all are looked at, and until then some of them in turn: what came over a connection is counted from
its beginning, and counts as much later.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeVar

GROWN_BYTES = 4 << 20
"""Memory of this process that is not there without a reason."""
LOOKS = 20
"""Looks in which each connection has its turn once."""

T = TypeVar("T")


class Looks:
    """Whose turn it is."""

    def __init__(self) -> None:
        self._least: float = math.inf
        self._next = 0

    def due(self, connections: Sequence[T], memory: int) -> Sequence[T]:
        """Those to look at now, of all that there are; `memory` is what this process has, in bytes.

        >>> looks = Looks()
        >>> looks.due("abc", 1 << 20), looks.due("abc", 2 << 20), looks.due("abc", 5 << 20)
        ('a', 'b', 'abc')
        """
        has_grown = memory - self._least >= GROWN_BYTES
        self._least = memory if has_grown else min(self._least, memory)
        if has_grown:
            return connections
        first = self._next if self._next < len(connections) else 0
        self._next = first + math.ceil(len(connections) / LOOKS)
        return connections[first : self._next]

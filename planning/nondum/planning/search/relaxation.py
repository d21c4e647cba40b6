"""The delete relaxation of a state: hFF with h_add's supporters, and what follows from it.

Source: Hoffmann and Nebel 2001 (FF); Keyder and Geffner 2008 (supporters of h_add); preferred
operators as in Helmert 2006.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from heapq import heappop, heappush

from nondum.planning.search.changes import RULE, Changes
from nondum.planning.search.encoding import Encoded, State

_UNMET = 1 << 40
"""Stands in a sum for a condition that is not met yet; more than any sum of costs."""


@dataclass(slots=True)
class Estimate:
    """What the relaxation says of a state that is no dead end."""

    distance: int
    """What the moves of the relaxed plan cost."""
    preferred: list[int]
    """Moves of the relaxed plan that can be made now."""
    applicable: list[int]
    """Moves that can be made now."""
    wanted: list[int]
    """The facts on the way of the relaxed plan that are not true yet."""


class Relaxation:
    """Evaluates the states of one task."""

    def __init__(self, encoded: Encoded, changes: Changes, costs: Sequence[int]) -> None:
        """`costs` are those of the moves."""
        self._width = encoded.width
        self._costs = costs
        self._changes = changes
        self._unmet = [
            len(needs) * _UNMET + (self._costs[move] if move != RULE else 0)
            for needs, move in zip(changes.needs, changes.moves, strict=True)
        ]
        self._unreached = [_UNMET] * changes.facts
        self.effort = sum(map(len, changes.needs)) + sum(map(len, changes.gives))
        """How much work an estimate is, at most."""

    def estimate(self, state: State) -> Estimate | None:
        """Estimate the way from a state to the goal. None: there is none, for certain."""
        changes = self._changes
        needing, gives, goal = changes.needing, changes.gives, changes.goal
        true = changes.facts_of(state)
        cost, unmet = self._unreached[:], self._unmet[:]
        for fact in true:
            cost[fact] = 0
        by: dict[int, int] = {}
        waiting = {0: true}
        levels = [0]
        ready: list[int] = []
        while levels:
            level = heappop(levels)
            met = level - _UNMET
            for fact in waiting[level]:
                if cost[fact] < level:
                    continue
                for change in needing[fact]:
                    total = unmet[change] + met
                    unmet[change] = total
                    if total < _UNMET:
                        if not level:
                            ready.append(change)
                        for given in gives[change]:
                            if total < cost[given]:
                                cost[given] = total
                                by[given] = change
                                if total in waiting:
                                    waiting[total].append(given)
                                else:
                                    waiting[total] = [given]
                                    heappush(levels, total)
            if cost[goal] < _UNMET:
                return self._estimate(state, by, unmet, ready)
        return None

    def _estimate(
        self, state: State, by: dict[int, int], unmet: list[int], ready: list[int]
    ) -> Estimate:
        needs, moves = self._changes.needs, self._changes.moves
        wanted = [self._changes.goal]
        seen = set(wanted)
        made: dict[int, None] = {}
        preferred: dict[int, None] = {}
        for fact in wanted:
            change = by[fact]
            move = moves[change]
            if move != RULE:
                made[move] = None
                if unmet[change] == self._costs[move]:
                    preferred[move] = None
            for need in needs[change]:
                if need in by and need not in seen:
                    seen.add(need)
                    wanted.append(need)
        count = len(self._costs)
        return Estimate(
            distance=sum(self._costs[move] for move in made),
            preferred=list(preferred),
            applicable=[change for change in ready if change < count],
            wanted=wanted,
        )

    def mask(self, facts: Iterable[int]) -> int:
        """The bits of those facts that are bits of a state."""
        total = 0
        for fact in facts:
            if fact < self._width:
                total |= 1 << fact
        return total

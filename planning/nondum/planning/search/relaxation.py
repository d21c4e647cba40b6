"""The delete relaxation of a state: hFF with h_add's supporters, and what follows from it.

Source: Hoffmann and Nebel 2001 (FF); Keyder and Geffner 2008 (supporters of h_add); preferred
operators as in Helmert 2006.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from heapq import heappop, heappush

from nondum.planning.search.changes import RULE, Changes, bits_of
from nondum.planning.search.encoding import Encoded, State

_UNMET = 1 << 40
"""Stands in a sum for a condition that is not met yet; more than any sum of costs."""
_ANY_ESTIMATE = 300
"""What even the smallest estimate takes of such steps."""


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
    """Evaluates the states of one task.

    What holds in a state, and which changes happen in it, is worked out from the last state that
    was evaluated: searches mostly go from one to the next.
    """

    def __init__(self, encoded: Encoded, changes: Changes, costs: Sequence[int]) -> None:
        """`costs` are those of the moves."""
        self._width = encoded.width
        self._costs = costs
        self._changes = changes
        self._facts = 0
        """Those that hold in the last state, those about what is false included."""
        self._cost = [_UNMET] * changes.facts
        """Fact → 0 where it holds in the last state."""
        self._unmet = [
            len(needs) * _UNMET + (costs[move] if move != RULE else 0)
            for needs, move in zip(changes.needs, changes.moves, strict=True)
        ]
        """Change → its cost, and what it lacks in the last state."""
        self._ready: set[int] = set()
        """The changes that lack nothing in the last state."""
        self.effort = _ANY_ESTIMATE + sum(map(len, (*changes.needs, *changes.gives)))
        """How much work an estimate is, at most: steps of its inner loops."""

    def estimate(self, state: State) -> Estimate | None:
        """Estimate the way from a state to the goal. None: there is none, for certain."""
        self._go_to(state)
        changes = self._changes
        needing, gives, goal = changes.needing, changes.gives, changes.goal
        cost, unmet = self._cost[:], self._unmet[:]
        ready = sorted(self._ready)
        by: dict[int, int] = {}
        waiting: dict[int, list[int]] = {}
        levels: list[int] = []
        for change in ready:
            total = unmet[change]
            for given in gives[change]:
                if total < cost[given]:
                    cost[given] = total
                    by[given] = change
                    if total in waiting:
                        waiting[total].append(given)
                    else:
                        waiting[total] = [given]
                        heappush(levels, total)
        while cost[goal] == _UNMET:
            if not levels:
                return None
            level = heappop(levels)
            met = level - _UNMET
            for fact in waiting[level]:
                if cost[fact] < level:
                    continue
                for change in needing[fact]:
                    total = unmet[change] + met
                    unmet[change] = total
                    if total < _UNMET:
                        for given in gives[change]:
                            if total < cost[given]:
                                cost[given] = total
                                by[given] = change
                                if total in waiting:
                                    waiting[total].append(given)
                                else:
                                    waiting[total] = [given]
                                    heappush(levels, total)
        return self._extracted(by, ready)

    def mask(self, facts: Iterable[int]) -> int:
        """The bits of those facts that are bits of a state."""
        total = 0
        for fact in facts:
            if fact < self._width:
                total |= 1 << fact
        return total

    def _go_to(self, state: State) -> None:
        facts, before = self._changes.facts_in(state), self._facts
        self._facts = facts
        needing, unmet, ready = self._changes.needing, self._unmet, self._ready
        for fact in bits_of(facts & ~before):
            self._cost[fact] = 0
            for change in needing[fact]:
                unmet[change] = lacking = unmet[change] - _UNMET
                if lacking < _UNMET:
                    ready.add(change)
        for fact in bits_of(before & ~facts):
            self._cost[fact] = _UNMET
            for change in needing[fact]:
                unmet[change] = lacking = unmet[change] + _UNMET
                if lacking < 2 * _UNMET:
                    ready.discard(change)

    def _extracted(self, by: dict[int, int], ready: list[int]) -> Estimate:
        """The relaxed plan, from the change that each fact is reached by."""
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
                if change in self._ready:
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

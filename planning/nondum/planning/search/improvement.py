"""Cheaper plans from a first one: steps that are not needed left out, then a search with a bound.

Source: Nakhost and Müller 2010 (action elimination); Hansen and Zhou 2007 (anytime weighted A*).
"""

from __future__ import annotations

from heapq import heappop, heappush

from nondum.planning.search.changes import Changes
from nondum.planning.search.encoding import Encoded, State
from nondum.planning.search.relaxation import Relaxation
from nondum.planning.search.tree import Moves

_SCALE = 1 << 10
"""Of two plans that cost the same the shorter one is better: a step costs 1, a unit this."""
_WEIGHT = 2
"""How much more the way to come counts than the way that lies behind."""


def eliminated(encoded: Encoded, plan: Moves) -> Moves:
    """The plan without steps that it reaches the goal without, each with those that need it."""
    position, state = 0, encoded.init
    while position < len(plan):
        shorter = _without(encoded, plan, position, state)
        if shorter is not None:
            plan = shorter
        else:
            state = encoded.after(state, encoded.moves[plan[position]])
            position += 1
    return plan


def _without(encoded: Encoded, plan: Moves, position: int, state: State) -> Moves | None:
    """The plan without a step, which begins in `state`, and without all later ones that can then
    not be made; None if it misses the goal."""
    kept = list(plan[:position])
    for index in plan[position + 1 :]:
        move = encoded.moves[index]
        if move.precondition & state == move.precondition:
            kept.append(index)
            state = encoded.after(state, move)
    return tuple(kept) if encoded.is_goal(state) else None


class Improvement:
    """A lazy weighted A* search for plans that cost less than the best one so far.

    It can be gone on with, and ends with a best plan of all where there is nothing left to look at.
    """

    def __init__(self, encoded: Encoded, changes: Changes, plan: Moves) -> None:
        self.plan = plan
        """The best one so far."""
        self._encoded = encoded
        self._costs = [move.cost * _SCALE + 1 for move in encoded.moves]
        self._bound = sum(self._costs[index] for index in plan)
        self._relaxation = Relaxation(encoded, changes, self._costs)
        self._ways: dict[State, tuple[int, State, int]] = {encoded.init: (0, encoded.init, -1)}
        """State → cost of the best way to it, the state before it, and the move between."""
        self._open: list[tuple[int, int, State, int]] = []
        self._count = 0
        self._expand(encoded.init, 0)

    def advance(self, effort: int) -> bool:
        """Go on for about so much work. True: it has ended."""
        while self._open:
            *_, before, index = heappop(self._open)
            way = self._ways[before][0] + self._costs[index]
            state = self._encoded.after(before, self._encoded.moves[index])
            known = self._ways.get(state)
            if way >= self._bound or (known and known[0] <= way):
                continue
            self._ways[state] = (way, before, index)
            if self._encoded.is_goal(state):
                self._bound, self.plan = way, self._moves_to(state)
                continue
            self._expand(state, way)
            effort -= self._relaxation.effort
            if effort < 0:
                return False
        return True

    def _expand(self, state: State, way: int) -> None:
        estimate = self._relaxation.estimate(state)
        if estimate is None:
            return
        rank = way + _WEIGHT * estimate.distance
        preferred = set(estimate.preferred)
        for index in estimate.applicable:
            cost = self._costs[index]
            if way + cost < self._bound:
                self._count += 1
                late = 0 if index in preferred else cost
                heappush(self._open, (rank + late, self._count, state, index))

    def _moves_to(self, state: State) -> Moves:
        moves: list[int] = []
        while state != self._encoded.init:
            _, state, move = self._ways[state]
            moves.append(move)
        return tuple(reversed(moves))

"""Lazy greedy best-first search with preferred moves first, as in Fast Downward's LAMA.

Source: Richter and Helmert 2009 (boosted preferred operators), Richter and Westphal 2010
(landmarks). LAMA has a separate open list for landmarks; here they are added to the distance, which
needed fewer estimates in most of the domains that it was tried in.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from heapq import heappop, heappush

from nondum.planning.search.encoding import Encoded, State
from nondum.planning.search.landmarks import Landmarks
from nondum.planning.search.relaxation import Relaxation
from nondum.planning.search.tree import Moves, SearchState, Tree

_BOOST = 1000
"""Turns that preferred moves get for every state nearer to the goal than any before."""
_FAR = 1 << 60
_PER_LANDMARK = 2
"""How much farther a state is for each landmark that is to come."""


class Greedy:
    """A search that can be gone on with. A state is estimated when it is taken out of the line, and
    stands there with the distance of the state before it."""

    def __init__(self, encoded: Encoded, relaxation: Relaxation, landmarks: Landmarks) -> None:
        self._encoded = encoded
        self._relaxation = relaxation
        self._landmarks = landmarks
        self._met: dict[State, int] = {}
        """The landmarks met on the way to states that it may go on from."""
        self._tree = Tree()
        self._all, self._preferred = _OpenList(), _OpenList()
        self._turn = 0
        """Above zero it is the turn of any moves, else of preferred ones."""
        self._nearest = _FAR
        self._start: State | None = encoded.init

    def advance(self, effort: int) -> Moves | SearchState:
        """Go on for about so much work. A search that has ended must not be gone on with."""
        relaxation_effort = self._relaxation.effort
        if self._start is not None:
            reached: tuple[State, tuple[State, int] | None] | None = (self._start, None)
            self._start = None
        else:
            reached = self._next()
        while reached is not None:
            state, before = reached
            self._tree.add(state, before)
            if self._encoded.is_goal(state):
                return self._tree.moves_to(state)
            self._expand(state, before)
            effort -= relaxation_effort
            if effort < 0:
                return SearchState.OPEN
            reached = self._next()
        return SearchState.EXHAUSTED

    def _expand(self, state: State, before: tuple[State, int] | None) -> None:
        estimate = self._relaxation.estimate(state)
        if estimate is None:
            return
        met = self._landmarks.met(self._met[before[0]] if before else 0, state)
        self._met[state] = met
        distance = estimate.distance + _PER_LANDMARK * self._landmarks.left(met, state)
        if distance < self._nearest:
            self._nearest = distance
            self._turn -= _BOOST
        self._preferred.push(distance, state, estimate.preferred)
        self._all.push(distance, state, estimate.applicable)

    def _next(self) -> tuple[State, tuple[State, int]] | None:
        """A state that was not reached before; None when there is none left."""
        moves, after, tree = self._encoded.moves, self._encoded.after, self._tree
        while step := self._step():
            state, index = step
            reached = after(state, moves[index])
            if reached not in tree:
                return reached, step
        return None

    def _step(self) -> tuple[State, int] | None:
        if self._turn > 0:
            self._turn -= 1
            return self._all.pop() or self._preferred.pop()
        self._turn += 1
        return self._preferred.pop() or self._all.pop()


class _OpenList:
    """States to go on from, nearest to the goal first, each with the moves to try there."""

    def __init__(self) -> None:
        self._at: dict[int, deque[tuple[State, Iterator[int]]]] = {}
        self._distances: list[int] = []

    def push(self, distance: int, state: State, moves: list[int]) -> None:
        if distance not in self._at:
            self._at[distance] = deque()
            heappush(self._distances, distance)
        self._at[distance].append((state, iter(moves)))

    def pop(self) -> tuple[State, int] | None:
        """The next state and move; None when there is none left."""
        while self._distances:
            line = self._at[self._distances[0]]
            while line:
                state, moves = line[0]
                for move in moves:
                    return state, move
                line.popleft()
            del self._at[heappop(self._distances)]
        return None

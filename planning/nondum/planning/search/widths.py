"""Best-first width search: states with a fact that is new among their like first, and among them
those with fewer landmarks to come. Cheap: few states are estimated.

Source: Lipovetzky and Geffner 2017, BFWS(f5), with landmarks in place of goals.
"""

from __future__ import annotations

from heapq import heappop, heappush

from nondum.planning.search.encoding import Encoded, State
from nondum.planning.search.landmarks import Landmarks
from nondum.planning.search.relaxation import Relaxation
from nondum.planning.search.successors import Successors
from nondum.planning.search.tree import Moves, SearchState, Tree
from nondum.sdk.frozen import frozen

_PER_STATE = 60
"""Work of making a state and looking whether it is new, in terms of `Relaxation.effort`."""


@frozen
class _Way:
    """How far a state has come."""

    left: int
    """Landmarks to come."""
    met: int
    """Landmarks met."""
    wanted: int
    """The facts that a relaxed plan makes true, from where `left` was last lowered."""
    held: int
    """Those of them that held since."""


class Widths:
    """A search that can be gone on with."""

    def __init__(self, encoded: Encoded, relaxation: Relaxation, landmarks: Landmarks) -> None:
        self._encoded = encoded
        self._relaxation = relaxation
        self._landmarks = landmarks
        self._successors = Successors(encoded)
        self._tree = Tree()
        self._open: list[tuple[bool, int, int, State, _Way]] = []
        self._seen: dict[tuple[int, int], int] = {}
        """Facts that held in some state, by landmarks to come and how many wanted facts held."""
        self._per_state = _PER_STATE + 2 * sum(len(stage.clauses) for stage in encoded.stages)
        self._count = 0
        self._effort = 0
        self._reach(encoded.init, None, None)

    def advance(self, effort: int) -> Moves | SearchState:
        """Go on for about so much work. A search that has ended must not be gone on with."""
        self._effort = effort
        moves, after, tree = self._encoded.moves, self._encoded.after, self._tree
        while self._open:
            *_, state, way = heappop(self._open)
            applicable = self._successors.of(state)
            for index in applicable:
                reached = after(state, moves[index])
                if reached not in tree:
                    self._reach(reached, (state, index), way)
                    if self._encoded.is_goal(reached):
                        return tree.moves_to(reached)
            self._effort -= self._per_state * (len(applicable) + 1)
            if self._effort < 0:
                return SearchState.OPEN
        return SearchState.EXHAUSTED

    def _reach(self, state: State, before: tuple[State, int] | None, way: _Way | None) -> None:
        self._tree.add(state, before)
        met = self._landmarks.met(way.met if way else 0, state)
        left = self._landmarks.left(met, state)
        if way is None or left < way.left:
            estimate = self._relaxation.estimate(state)
            self._effort -= self._relaxation.effort
            if estimate is None:
                return
            way = _Way(left, met, self._relaxation.mask(estimate.wanted), 0)
        elif left > way.left or met != way.met or state & way.wanted & ~way.held:
            way = _Way(left, met, way.wanted, way.held | state & way.wanted)
        like = (left, way.held.bit_count())
        seen = self._seen.get(like, 0)
        is_known = not state & ~seen
        if not is_known:
            self._seen[like] = seen | state
        self._count += 1
        heappush(self._open, (is_known, left, self._count, state, way))

"""Facts that hold at some time in every plan, and how many of them are still to come.

Source: Zhu and Givan 2003 (all landmarks of the delete relaxation, by propagation); Richter and
Westphal 2010 (counting them). Sets of facts are masks here, so the propagation is quick.
"""

from __future__ import annotations

from collections import deque

from nondum.planning.search.changes import Changes, bits_of
from nondum.planning.search.encoding import Encoded, State


class Landmarks:
    """The landmarks of one task. What of them a way has met is a mask."""

    def __init__(self, encoded: Encoded, changes: Changes) -> None:
        self._goal = encoded.goal
        before_goal = _before_each(changes, encoded)[changes.goal] or 0
        self._all = encoded.goal | before_goal & ~(-1 << encoded.width)

    def met(self, met: int, state: State) -> int:
        """What is met by a way that met `met` before it came to `state`."""
        return met | state & self._all

    def left(self, met: int, state: State) -> int:
        """How many are to come: those never met, and the goals that do not hold."""
        return (self._all & ~met | self._goal & ~state).bit_count()


def _before_each(changes: Changes, encoded: Encoded) -> list[int | None]:
    """Fact → the facts that hold at some time before it, with itself; None: it is out of reach."""
    before: list[int | None] = [None] * changes.facts
    for fact in bits_of(changes.facts_in(encoded.init)):
        before[fact] = 0
    unmet = [sum(before[fact] is None for fact in needs) for needs in changes.needs]
    waiting = deque(change for change, count in enumerate(unmet) if not count)
    is_waiting = [not count for count in unmet]
    while waiting:
        change = waiting.popleft()
        is_waiting[change] = False
        all_before = 0
        for fact in changes.needs[change]:
            all_before |= before[fact] or 0
        for fact in changes.gives[change]:
            old, new = before[fact], all_before | 1 << fact
            if old is not None:
                new &= old
            if new == old:
                continue
            before[fact] = new
            for user in changes.needing[fact]:
                unmet[user] -= old is None
                if not unmet[user] and not is_waiting[user]:
                    is_waiting[user] = True
                    waiting.append(user)
    return before

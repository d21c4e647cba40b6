"""The states that a search has reached, and how."""

from __future__ import annotations

from enum import Enum
from typing import TypeAlias

from nondum.planning.search.encoding import State


class SearchState(Enum):
    """How a search that has found no plan stands."""

    OPEN = "there are states left to go on from"
    EXHAUSTED = "every state that can be reached was looked at, dead ends left out"


Moves: TypeAlias = tuple[int, ...]
"""A plan, as indices of moves."""


class Tree:
    """State → the state before it and the move between; the first way to each is kept."""

    def __init__(self) -> None:
        self._before: dict[State, tuple[State, int] | None] = {}

    def __contains__(self, state: State) -> bool:
        return state in self._before

    def add(self, state: State, before: tuple[State, int] | None) -> None:
        """Add a state that is not in yet; the first of all has none before it."""
        self._before[state] = before

    def moves_to(self, state: State) -> Moves:
        """The moves from the first state to this one."""
        moves: list[int] = []
        while (step := self._before[state]) is not None:
            state, move = step
            moves.append(move)
        return tuple(reversed(moves))

"""The planner as one function: strategies take turns until one of them has a plan or a proof."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

from nondum.planning.ground.delete_relaxation import quick_answer, reachable_facts
from nondum.planning.search.changes import Changes
from nondum.planning.search.encoding import Encoded, encode
from nondum.planning.search.greedy import Greedy
from nondum.planning.search.improvement import Improvement, eliminated
from nondum.planning.search.landmarks import Landmarks
from nondum.planning.search.relaxation import Relaxation
from nondum.planning.search.tree import Moves, SearchState
from nondum.planning.search.widths import Widths
from nondum.sdk.planner import Answer, GaveUp, GroundTask, Plan, Unsolvable

IsOver: TypeAlias = Callable[[], bool]
"""Whether the time is up."""
_SLICE = 400_000
"""Work between two looks at the clock: some tens of milliseconds."""
_FIRST_TURN = 8
"""Slices of the first turn; each later one is half as long again."""

_IMPROVED_MOVES = 1_000
"""In a task of up to this number of moves, a cheaper plan is worth looking for, …"""
_IMPROVED_SLICES = 2
"""… for this number of slices."""


def solve(task: GroundTask, is_over: IsOver) -> Answer:
    """Find a plan, or a proof that there is none.

    The answer does not depend on the clock, unless it is that time ran out.
    """
    reached = reachable_facts(task)
    if (known := quick_answer(task, reached)) is not None:
        return known
    encoded = encode(task, reached)
    changes = Changes(encoded)
    found = _searched(encoded, changes, is_over)
    match found:
        case SearchState.EXHAUSTED:
            return Unsolvable("exhausted")
        case SearchState.OPEN:
            return GaveUp("the time was up")
    plan = _improved(encoded, changes, eliminated(encoded, found), is_over)
    steps = tuple(encoded.moves[index].action for index in plan)
    return Plan(steps, sum(task.actions[step].cost for step in steps))


def _searched(encoded: Encoded, changes: Changes, is_over: IsOver) -> Moves | SearchState:
    relaxation = Relaxation(encoded, changes, [1] * len(encoded.moves))
    landmarks = Landmarks(encoded, changes)
    greedy = Greedy(encoded, relaxation, landmarks)
    widths: Widths | None = None
    turn = _FIRST_TURN
    while True:
        found = _advanced(greedy, turn, is_over)
        if found is SearchState.OPEN and not is_over():
            widths = widths or Widths(encoded, relaxation, landmarks)
            found = _advanced(widths, turn, is_over)
        if found is not SearchState.OPEN or is_over():
            return found
        turn += (turn + 1) // 2


def _advanced(search: Greedy | Widths, turn: int, is_over: IsOver) -> Moves | SearchState:
    """Have a search take its turn."""
    for _ in range(turn):
        if is_over():
            break
        found = search.advance(_SLICE)
        if found is not SearchState.OPEN:
            return found
    return SearchState.OPEN


def _improved(encoded: Encoded, changes: Changes, plan: Moves, is_over: IsOver) -> Moves:
    if len(encoded.moves) > _IMPROVED_MOVES:
        return plan
    search = Improvement(encoded, changes, plan)
    for _ in range(_IMPROVED_SLICES):
        if is_over() or search.advance(_SLICE):
            break
    return search.plan

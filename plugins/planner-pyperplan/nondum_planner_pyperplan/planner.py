"""The planner: a ground task translated for pyperplan, and its answer translated back.

Facts stay integers, so results do not depend on PYTHONHASHSEED.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import ClassVar

from pyperplan.heuristics.relaxation import hFFHeuristic
from pyperplan.search import greedy_best_first_search
from pyperplan.search.searchspace import SearchNode
from pyperplan.task import Operator, Task

from nondum.sdk.planner import AlreadyTrue, Answer, GaveUp, GroundTask, Plan, Unsolvable


class _DeadlinePassed(Exception):
    """The search has used up its time."""


class _Heuristic:
    """hFF that looks at the clock: pyperplan asks it about every node, and has no limit itself."""

    def __init__(self, task: Task, until_s: float, now_s: Callable[[], float]) -> None:
        self._estimate = hFFHeuristic(task)
        self._until_s, self._now_s = until_s, now_s

    def __call__(self, node: SearchNode) -> float:
        if self._now_s() > self._until_s:
            raise _DeadlinePassed
        estimate: float = self._estimate(node)
        return estimate


class PyperplanPlanner:
    """Complete: without pruning by preferred operators, every reachable state is looked at."""

    speaks: ClassVar[str] = "ground"
    handles: ClassVar[frozenset[str]] = frozenset()

    def __init__(self, now_s: Callable[[], float] = time.monotonic) -> None:
        """`now_s` is the clock that deadlines are judged by, in seconds."""
        self._now_s = now_s

    def plan(self, task: GroundTask, deadline_s: float) -> Answer:
        """Search for at most about `deadline_s` seconds; never raises for lack of time."""
        until_s = self._now_s() + deadline_s
        if task.goal <= task.init:
            return AlreadyTrue()
        translated = _translated(task)
        heuristic = _Heuristic(translated, until_s, self._now_s)
        try:
            if heuristic(SearchNode(translated.initial_state, None, None, 0)) == float("inf"):
                return Unsolvable("relaxed")
            found = greedy_best_first_search(translated, heuristic)
        except _DeadlinePassed:
            return GaveUp(f"no plan within {round(deadline_s, 1):g} s")
        if found is None:
            return Unsolvable("exhausted")
        steps = tuple(int(operator.name) for operator in found)
        return Plan(steps, sum(task.actions[step].cost for step in steps))


def _translated(task: GroundTask) -> Task:
    """The same task without the facts that are true and stay so; operators are named by index.

    Those facts cost time at every node, and say nothing.
    """
    lasting = task.init.difference(*(action.delete for action in task.actions))
    operators = [
        Operator(str(index), action.precondition - lasting, action.add - lasting, action.delete)
        for index, action in enumerate(task.actions)
    ]
    facts = frozenset(range(len(task.facts))) - lasting
    return Task("nondum", facts, task.init - lasting, task.goal - lasting, operators)

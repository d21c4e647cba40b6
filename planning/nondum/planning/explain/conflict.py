"""Goals whose parts can be reached, but not together: which exclude each other, and over what."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from itertools import combinations
from typing import TypeAlias

from nondum.planning.ground.ground import ground
from nondum.planning.merge.core import TAKEN_PREDICATES
from nondum.planning.merge.domain import Merged
from nondum.planning.merge.goal import GoalExpr, goal_text
from nondum.planning.pddl.facts import parts
from nondum.planning.pddl.normal import condition_of, joined
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen
from nondum.sdk.planner import AlreadyTrue, Answer, GaveUp, GroundTask, Plan, Unsolvable

Search: TypeAlias = Callable[[GroundTask], Answer]
"""Plans a small task, within its own bounds."""

_PARTS_LIMIT = 8
"""Of a goal with more parts, these are looked at."""


@frozen
class Conflict:
    """What keeps a goal from being reached although nothing is missing for any part of it."""

    alone: tuple[str, ...] = ()
    """Parts that cannot be reached even by themselves."""
    pairs: tuple[tuple[str, str], ...] = ()
    """Parts that can each be reached, but not both."""
    contested: tuple[str, ...] = ()
    """Resources (`free …`, `idle …`) that more than one step would take."""
    undecided: bool = False
    """Whether something was not found out within bounds."""

    def problems(self) -> tuple[Problem, ...]:
        """The conflict in words."""
        wanted = ", ".join(f"({text})" for text in self.contested)
        over = f"; wanted twice: {wanted}" if wanted else ""
        more = "; which parts exclude each other was not found out" if self.undecided else ""
        fix = "ask for one after the other, or bring another of the kind" if wanted else ""
        if self.alone:
            return tuple(
                Problem("WHY_NOT_ALONE", f"all that {part} needs is here, but not at once{over}")
                for part in self.alone
            )
        if self.pairs:
            message = "cannot both be reached, though each can"
            return tuple(
                Problem("WHY_EXCLUDE_EACH_OTHER", f"{one} and {other} {message}{over}", fix=fix)
                for one, other in self.pairs
            )
        message = "all that is needed is here, but not at the same time"
        return (Problem("WHY_NOT_TOGETHER", f"{message}{over}{more}", fix=fix),)


def conflict_of(
    merged: Merged,
    facts: frozenset[str],
    goal: GoalExpr,
    objects: Mapping[str, tuple[str, ...]] | None,
    search: Search | None,
) -> Conflict:
    """Plan for each part alone, then for pairs. Without `search` only resources are told."""
    together = ground(merged, facts, goal, objects)
    if search is None:
        return Conflict(contested=_taken_by_many(together), undecided=True)
    return _Trial(merged, facts, objects, search).of(goal, together)


class _Trial:
    def __init__(
        self,
        merged: Merged,
        facts: frozenset[str],
        objects: Mapping[str, tuple[str, ...]] | None,
        search: Search,
    ) -> None:
        self._merged = merged
        self._facts = facts
        self._objects = objects
        self._search = search
        self._undecided = False

    def of(self, goal: GoalExpr, together: GroundTask) -> Conflict:
        wanted = [condition_of(part) for part in goal.parts()][:_PARTS_LIMIT]
        taken = {part: self._taken(part) for part in wanted} if len(wanted) > 1 else {}
        if alone := tuple(goal_text(part) for part, found in taken.items() if found is None):
            return Conflict(alone, contested=_taken_by_many(together), undecided=self._undecided)
        pairs = [pair for pair in combinations(taken, 2) if self._exclude_each_other(pair, goal)]
        contested = {
            r for one, other in pairs for r in (taken[one] or set()) & (taken[other] or set())
        }
        resources = tuple(sorted(contested)) or _taken_by_many(together)
        told = tuple((goal_text(one), goal_text(other)) for one, other in pairs)
        return Conflict((), told, resources, self._undecided)

    def _exclude_each_other(self, pair: tuple[GoalExpr, GoalExpr], goal: GoalExpr) -> bool:
        """Two parts that are the whole goal do: it has no plan."""
        return joined(pair) == goal or self._taken(joined(pair)) is None

    def _taken(self, part: GoalExpr) -> frozenset[str] | None:
        """The resources that a plan for it takes; None where there is no plan."""
        task = ground(self._merged, self._facts, part, self._objects)
        match self._search(task):
            case Plan(steps):
                return frozenset(_taken(task, steps))
            case Unsolvable():
                return None
            case GaveUp():
                self._undecided = True
            case AlreadyTrue():
                pass
        return frozenset()


def _taken(task: GroundTask, steps: Iterable[int]) -> Iterator[str]:
    for step in steps:
        for index in task.actions[step].delete:
            if parts(task.facts[index])[0] in TAKEN_PREDICATES:
                yield task.facts[index]


def _taken_by_many(task: GroundTask) -> tuple[str, ...]:
    """The resources that more than one action of the task takes."""
    counts: dict[int, int] = {}
    for action in task.actions:
        for index in action.delete:
            counts[index] = counts.get(index, 0) + 1
    return tuple(
        task.facts[index]
        for index, count in sorted(counts.items())
        if count > 1 and parts(task.facts[index])[0] in TAKEN_PREDICATES
    )

"""What people want of the host: one queue, the most wanted first."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from enum import Enum

from nondum.host.catalogue.records import GoalRecord
from nondum.planning.goal import GoalKind
from nondum.sdk.errors import GoalRefused, Problem

HIGHEST_PRIORITY = 1000
MAX_ENDED = 50
"""How many ended goals are remembered."""


class GoalState(Enum):
    """Where a goal is."""

    KEPT = "kept"
    """Its words mean nothing yet; they are tried again whenever a payload has come."""
    QUEUED = "queued"
    """Waits for its turn, or for its first plan."""
    ACTIVE = "active"
    """Its plan is carried out, or held."""
    SUSPENDED = "suspended"
    """There is no plan as things are; it is tried again when something new is known."""
    REACHED = "reached"
    """It was to be achieved, and was."""
    HALTED = "halted"
    """A person halted it, or it was replaced."""

    @property
    def is_final(self) -> bool:
        """Whether the goal is over."""
        return self in (GoalState.REACHED, GoalState.HALTED)


@dataclass(frozen=True, slots=True)
class GivenGoal:
    """A goal as it stands."""

    id: str
    text: str
    """As the person gave it: words or PDDL."""
    pddl: str
    """Empty: the words mean nothing yet."""
    kind: GoalKind
    priority: int
    number: int
    """Counts up: a greater number was given later."""
    state: GoalState = GoalState.QUEUED
    reason: str = ""
    """Why it is where it is."""
    problems: tuple[Problem, ...] = ()
    """What keeps it suspended."""
    replaced_by: str = ""
    """The goal that has taken its place."""

    def to_dict(self) -> dict[str, object]:
        """Plain data for people's tools."""
        return {
            "id": self.id,
            "goal": self.pddl,
            "text": self.text,
            "kind": self.kind if self.pddl else "",
            "priority": self.priority,
            "state": self.state.value,
            "reason": self.reason,
            "problems": [problem.to_dict() for problem in self.problems],
            "resumable": self.is_resumable,
        }

    @property
    def is_resumable(self) -> bool:
        """Whether a person can have it taken up again; payloads bring theirs again themselves."""
        return self.state is GoalState.HALTED and "/" not in self.id


def _number(id: str) -> int:
    return int(id) if id.isdecimal() else 0


def urgency(goal: GivenGoal) -> tuple[int, bool, int]:
    """Sort key: by priority; what can be finished before what never ends; of goals to achieve the
    first, of goals to maintain the last, for it is what the person wants now."""
    lasts = goal.kind == "maintain"
    return -goal.priority, lasts, -goal.number if lasts else goal.number


class GoalQueue:
    """The goals given to one host since it started, and those that it had not done before."""

    def __init__(self) -> None:
        self._goals: dict[str, GivenGoal] = {}
        self._given = 0

    def __iter__(self) -> Iterator[GivenGoal]:
        """All goals, in the order they were given."""
        return iter(tuple(self._goals.values()))

    def __getitem__(self, id: str) -> GivenGoal:
        """The goal of that id. Raises `GoalRefused` (GOAL_UNKNOWN)."""
        if id not in self._goals:
            known = ", ".join(self._goals) or "none was given"
            raise GoalRefused(
                Problem("GOAL_UNKNOWN", f"there is no goal {id!r}", fix=f"goals: {known}")
            )
        return self._goals[id]

    def give(
        self, text: str, pddl: str, kind: GoalKind, *, priority: int = 0, id: str = ""
    ) -> GivenGoal:
        """Add a goal; with an `id` of its own it takes the place of the one before of that id.

        What was kept counts as given when its words were said.
        """
        before = self._goals.get(id)
        if before is not None and before.state is GoalState.KEPT:
            goal = replace(before, text=text, pddl=pddl, kind=kind, state=GoalState.QUEUED)
            self._goals[id] = goal = replace(goal, priority=priority, reason="", problems=())
            return goal
        self._given += 1
        goal = GivenGoal(id or str(self._given), text, pddl, kind, priority, self._given)
        self._goals.pop(goal.id, None)
        self._goals[goal.id] = goal
        self._forget_oldest()
        return goal

    def keep(self, words: str, *, priority: int = 0, reason: str = "") -> GivenGoal:
        """Keep words that mean nothing yet, for a reason."""
        self._given += 1
        id = str(self._given)
        self._goals[id] = GivenGoal(
            id, words, "", "achieve", priority, self._given, GoalState.KEPT, reason
        )
        return self._goals[id]

    def restore(self, goals: Iterable[GoalRecord]) -> tuple[GivenGoal, ...]:
        """Take up the goals of an earlier run, under their ids; none that is here already."""
        restored = []
        for kept in goals:
            if kept.id not in self._goals:
                self._given = max(self._given + 1, _number(kept.id))
                goal = GivenGoal(
                    kept.id, kept.text, kept.pddl, kept.kind, kept.priority, self._given
                )
                self._goals[goal.id] = goal
                restored.append(goal)
        return tuple(restored)

    def wanted(self, is_worth_a_try: Callable[[GivenGoal], bool]) -> GivenGoal | None:
        """The most urgent goal that is not over. Suspended ones count if they are worth a try."""
        candidates = [
            goal
            for goal in self._goals.values()
            if not goal.state.is_final
            and goal.state is not GoalState.KEPT
            and (goal.state is not GoalState.SUSPENDED or is_worth_a_try(goal))
        ]
        return min(candidates, key=urgency, default=None)

    def put(
        self, id: str, state: GoalState, reason: str = "", problems: tuple[Problem, ...] = ()
    ) -> GivenGoal:
        """Set where a goal is and why. Goals that are over stay so."""
        goal = self._goals[id]
        if not goal.state.is_final:
            goal = self._goals[id] = replace(goal, state=state, reason=reason, problems=problems)
        return goal

    def activate(self, id: str) -> tuple[GivenGoal, ...]:
        """Make a goal the active one. Gives the goals to maintain that it replaces."""
        active = self.put(id, GoalState.ACTIVE)
        replaced = []
        for goal in self:
            if goal.id == id or goal.state.is_final:
                continue
            if goal.state is GoalState.ACTIVE:
                self.put(goal.id, GoalState.QUEUED, f"waits for goal {id}")
            if is_replaced(goal, active):
                halted = self.put(goal.id, GoalState.HALTED, f"replaced by goal {id}")
                self._goals[goal.id] = replace(halted, replaced_by=id)
                replaced.append(self._goals[goal.id])
        return tuple(replaced)

    def replaces(self, id: str) -> tuple[GivenGoal, ...]:
        """The goals whose place a goal has taken, or takes as soon as it has a plan."""
        by = self._goals[id]
        return tuple(
            goal
            for goal in self
            if goal.replaced_by == id or (not _either_is_over(goal, by) and is_replaced(goal, by))
        )

    def _forget_oldest(self) -> None:
        ended = [goal.id for goal in self._goals.values() if goal.state.is_final]
        for id in ended[: max(0, len(ended) - MAX_ENDED)]:
            del self._goals[id]


def _either_is_over(*goals: GivenGoal) -> bool:
    return any(goal.state.is_final for goal in goals)


def is_replaced(goal: GivenGoal, by: GivenGoal) -> bool:
    """Whether a newer goal to maintain takes the place of an older one."""
    return (
        goal.kind == by.kind == "maintain"
        and goal.priority <= by.priority
        and goal.number < by.number
    )

"""What people want of the host: one queue, the most wanted first."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from enum import Enum

from nondum.host.core.records.goal import GoalRecord
from nondum.host.mind.lack import Need
from nondum.planning.merge.goal import GoalKind
from nondum.sdk.errors import GoalRefused, Problem
from nondum.sdk.frozen import frozen

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
    """Its plan is carried out, or held, perhaps beside those of other goals."""
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


@frozen
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
    needs: tuple[Need, ...] = ()
    """What it lacks, of that which keeps it suspended."""
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
            "needs": [need.to_dict() for need in self.needs],
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
        """Add a goal; with an `id` it takes the place of the goal that has had that id.

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

    def open(self) -> tuple[GivenGoal, ...]:
        """The goals that are not over and mean something, the most urgent first."""
        over = (GoalState.REACHED, GoalState.HALTED, GoalState.KEPT)
        return tuple(sorted((g for g in self if g.state not in over), key=urgency))

    def put(
        self,
        id: str,
        state: GoalState,
        reason: str = "",
        problems: tuple[Problem, ...] = (),
        needs: tuple[Need, ...] = (),
    ) -> GivenGoal:
        """Set where a goal is and why. Goals that are over stay so."""
        goal = self._goals[id]
        if not goal.state.is_final:
            goal = replace(goal, state=state, reason=reason, problems=problems, needs=needs)
            self._goals[id] = goal
        return goal

    def put_aside(self, id: str, behind: str, shared: str = "") -> GivenGoal:
        """Have a goal wait for another one, with which it shares something; a goal to maintain that
        a newer one takes the place of is over."""
        goal = self._goals[id]
        if is_replaced(goal, self._goals[behind]):
            goal = self.put(id, GoalState.HALTED, f"replaced by goal {behind}")
            self._goals[id] = replace(goal, replaced_by=behind)
            return self._goals[id]
        why = f": both need {shared}" if shared else ""
        return self.put(id, GoalState.QUEUED, f"waits for goal {behind}{why}")

    def replaces(self, id: str) -> tuple[GivenGoal, ...]:
        """The goals whose place a goal has taken, or takes if its plan needs what they need."""
        by = self._goals[id]
        has_no_plan_yet = by.state in (GoalState.QUEUED, GoalState.SUSPENDED)
        return tuple(
            goal
            for goal in self
            if goal.replaced_by == id
            or (has_no_plan_yet and not goal.state.is_final and is_replaced(goal, by))
        )

    def _forget_oldest(self) -> None:
        ended = [goal.id for goal in self._goals.values() if goal.state.is_final]
        for id in ended[: max(0, len(ended) - MAX_ENDED)]:
            del self._goals[id]


def is_replaced(goal: GivenGoal, by: GivenGoal) -> bool:
    """Whether a newer goal to maintain takes the place of an older one that it cannot be kept
    beside."""
    return (
        goal.kind == by.kind == "maintain"
        and goal.priority <= by.priority
        and goal.number < by.number
    )

"""A goal that is being pursued, and how."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from nondum.planning.execute.independence import Reservation
from nondum.planning.execute.plan_executive import Phase
from nondum.planning.execute.task_tree import TaskTree
from nondum.sdk.planner import GroundTask, Plan


@dataclass(slots=True, eq=False)
class Pursued:
    """One goal with its plan and the tree of it."""

    goal: str
    """Its id."""
    task: GroundTask
    plan: Plan
    tree: TaskTree
    reservation: Reservation
    """What its plan needs for itself."""
    is_outdated: bool = False
    """The plan does not fit the components that are here now, or the plans of other goals."""
    phase: Phase = Phase.UNDER_WAY
    """As people were last told."""
    trouble: str = ""
    """What is tried again, and why, as the goal's reason was last said to be."""

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the plan's actions."""
        return tuple(self.task.actions[step].name for step in self.plan.steps)


def conflicts(pursued: Iterable[Pursued]) -> dict[str, str]:
    """Goal → a more urgent one beside which its plan cannot be carried out; they come in order."""
    found: dict[str, str] = {}
    kept: list[Reservation] = []
    for one in pursued:
        firm = next((other.goal for other in kept if one.reservation.conflict(other)), None)
        if firm is None:
            kept.append(one.reservation)
        else:
            found[one.goal] = firm
    return found

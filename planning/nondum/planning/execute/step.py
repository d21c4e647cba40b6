"""One step of a plan, in words: a ground action that outlives the task it was grounded in."""

from __future__ import annotations

from collections.abc import Collection

from nondum.sdk.frozen import frozen
from nondum.sdk.planner import GroundAction, GroundTask, Plan


@frozen
class Step:
    """An action of a plan and what it means for facts as text."""

    action: GroundAction
    precondition: frozenset[str]
    add: frozenset[str]
    delete: frozenset[str]
    lasting: bool
    """Its effects hold only while it runs, and what it deletes returns when it ends."""
    guard: frozenset[str]
    """What must hold as long as it runs: its preconditions less what it deletes itself."""

    @property
    def name(self) -> str:
        """The action's name, the same in every task that has the action."""
        return self.action.name

    @property
    def actor(self) -> str:
        """The unit that acts, or nothing for an action without parameters."""
        return self.action.arguments[0] if self.action.arguments else ""

    @classmethod
    def from_action(cls, task: GroundTask, action: GroundAction, *, lasting: bool) -> Step:
        """Write the facts of one of a task's actions as text."""
        precondition = words(task, action.precondition)
        add = words(task, action.add)
        # Where an action adds and deletes one fact, adding wins (PDDL 2.1).
        delete = words(task, action.delete) - add
        return cls(action, precondition, add, delete, lasting, precondition - delete)


def words(task: GroundTask, facts: Collection[int]) -> frozenset[str]:
    """Facts of a task as text."""
    return frozenset(task.facts[fact] for fact in facts)


def steps_of(task: GroundTask, plan: Plan, lasting: frozenset[str]) -> tuple[Step, ...]:
    """The steps of a plan; `lasting` names the schemas of lasting behaviours."""
    actions = (task.actions[index] for index in plan.steps)
    return tuple(
        Step.from_action(task, action, lasting=action.schema in lasting) for action in actions
    )

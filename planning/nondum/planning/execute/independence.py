"""Which plans may be carried out side by side: those that take nothing from each other.

Two plans are independent if no step of one ends what a step of the other needs or gives (Graphplan,
Blum and Furst 1997), and no unit that serves one behaviour at a time acts in both. What one plan
keeps true by itself another may rely on.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace

from nondum.planning.execute.step import Step
from nondum.planning.pddl.facts import is_twin, parts, predicate_of, twin
from nondum.sdk.frozen import frozen
from nondum.sdk.planner import GroundAction, GroundTask

_UNIT_IS_TAKEN = frozenset({"idle", "free"})
"""Predicates of `nondum-core` that an action deletes to take what they are about."""


@frozen
class Reservation:
    """What a plan needs for itself as long as its goal is pursued."""

    goal: str
    """Id of the goal."""
    wanted: frozenset[str]
    """The goal's facts."""
    actions: frozenset[str]
    """The names of its actions."""
    units: frozenset[str]
    """The units that act in it and serve one behaviour at a time."""
    needs: frozenset[str]
    """Facts, twins included, that no other plan may make false."""
    ends: frozenset[str]
    """Facts, twins included, that it makes false itself."""

    @classmethod
    def of(
        cls, goal: str, steps: Sequence[Step], wanted: frozenset[str], exclusive: Collection[str]
    ) -> Reservation:
        """What a plan for a goal of that id reserves; `wanted` are the goal's facts, `exclusive`
        the units that serve one behaviour at a time."""
        return cls(
            goal,
            wanted,
            frozenset(step.name for step in steps),
            frozenset(step.actor for step in steps if step.actor in exclusive),
            wanted.union(*(step.precondition | step.add for step in steps)),
            frozenset(f for step in steps for f in (*step.delete, *map(twin, step.add))),
        )

    def conflict(self, other: Reservation) -> str:
        """What both plans would have to have for themselves, in words; empty: nothing.

        Of two goals that want the same only one is pursued: halting it then ends all that it did.
        """
        if self.wanted == other.wanted:
            return _in_words(self.wanted)
        if units := self.units & other.units:
            return min(units)
        if actions := self.actions & other.actions:
            return min(parts(action)[1][:1] or (action,) for action in actions)[0]
        return _in_words((self.ends & other.needs) | (other.ends & self.needs))


def conflicting(plan: Reservation, others: Iterable[Reservation]) -> dict[str, str]:
    """Goal → what its plan shares with `plan`, of those that cannot be carried out beside it."""
    return {other.goal: shared for other in others if (shared := plan.conflict(other))}


def kept_clear(
    task: GroundTask, others: Collection[Reservation], exclusive: Collection[str]
) -> GroundTask:
    """The task without the actions that cannot be under way beside other plans.

    What follows from effects by rules is not looked at: the plan is to be compared as well.
    """
    needs = frozenset[str]().union(*(other.needs for other in others))
    ends = frozenset[str]().union(*(other.ends for other in others))
    taken = frozenset[str]().union(*(other.actions for other in others))
    units = frozenset[str]().union(*(other.units for other in others)) & frozenset(exclusive)
    numbered = tuple(enumerate(task.facts))
    to_keep = frozenset(n for n, text in numbered if text in needs)
    to_deny = frozenset(n for n, text in numbered if twin(text) in needs)
    to_end = frozenset(n for n, text in numbered if text in ends)

    def is_clear(action: GroundAction) -> bool:
        if action.name in taken or units & frozenset(action.arguments[:1]):
            return False
        add = action.add.union(*(one.add for one in action.conditional))
        delete = action.delete.union(*(one.delete for one in action.conditional))
        is_ended = (action.precondition | add) & to_end
        return not (is_ended or (delete - add) & to_keep or add & to_deny)

    return replace(task, actions=tuple(action for action in task.actions if is_clear(action)))


def _in_words(facts: frozenset[str]) -> str:
    """The thing that is taken, where the facts say so; else a fact in PDDL.

    >>> _in_words(frozenset({"idle base", "at base kitchen"}))
    'base'
    >>> _in_words(frozenset({"!at base kitchen"}))
    '(not (at base kitchen))'
    """
    things = [parts(fact)[1][0] for fact in facts if predicate_of(fact) in _UNIT_IS_TAKEN]
    if things or not facts:
        return min(things, default="")
    fact = min(facts)
    return f"(not ({twin(fact)}))" if is_twin(fact) else f"({fact})"

"""What the robot would do for a goal that is not given yet, to be read back to who asked for it."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from typing import Any

from nondum.host.mind import short_names
from nondum.host.mind.composition import Composition
from nondum.host.mind.diagnosis import Seen, why_not
from nondum.host.mind.lack import Need
from nondum.host.mind.missing_reports import Silence
from nondum.planning.ground.delete_relaxation import quick_answer
from nondum.planning.ground.ground import ground
from nondum.planning.merge.goal import Goal
from nondum.planning.search import solve
from nondum.sdk.errors import FragmentRefused
from nondum.sdk.frozen import frozen
from nondum.sdk.planner import AlreadyTrue, GroundAction, Plan, Unsolvable

SEARCH_S = 1.0
"""How long a plan is looked for: a person waits for the answer."""


@frozen
class Preview:
    """What would become of a goal."""

    now: str
    """`holds`, `can`, `cannot` or `unknown`, as `offers` has it."""
    steps: tuple[str, ...] = ()
    """Of a plan for it, as they are told; when it is given, another one may be found."""
    components: tuple[str, ...] = ()
    """Those that would act, in the order of the steps."""
    needs: tuple[Need, ...] = ()
    """What is missing, where it cannot be had."""

    def to_dict(self) -> dict[str, Any]:
        """Plain data for people's tools."""
        needs = [need.to_dict() for need in self.needs]
        steps, components = list(self.steps), list(self.components)
        return {"now": self.now, "steps": steps, "components": components, "needs": needs}


def preview(
    composition: Composition,
    goal: Goal,
    facts: frozenset[str],
    bare_facts: frozenset[str],
    seen: Iterable[Seen],
    names: Mapping[str, str],
) -> Preview:
    """Plan for a goal beside all that is pursued. `facts` are those that hold, `bare_facts` those
    that would if nothing ran; `names` are short ones of units. It takes its time, so call it in a
    thread."""
    until_s = time.monotonic() + SEARCH_S
    try:
        if goal.kind != "do" and _holds(composition, goal, facts):
            return Preview("holds")
        task = ground(composition.merged, bare_facts, goal.expr)
        answer = solve(task, lambda: time.monotonic() > until_s)
    except FragmentRefused:  # there are too many ways
        return Preview("unknown")
    match answer:
        case AlreadyTrue():
            return Preview("holds")
        case Plan(steps):
            return _planned([task.actions[index] for index in steps], composition, names)
        case Unsolvable():
            silence = Silence.of(composition.snapshot)
            why = why_not(composition.merged, goal, bare_facts, seen, silence=silence)
            return Preview("cannot", needs=why.needs)
    return Preview("unknown")


def _holds(composition: Composition, goal: Goal, facts: frozenset[str]) -> bool:
    return isinstance(quick_answer(ground(composition.merged, facts, goal.expr)), AlreadyTrue)


def _planned(
    actions: list[GroundAction], composition: Composition, names: Mapping[str, str]
) -> Preview:
    called = short_names.steps((action.name for action in actions), names)
    objects = composition.merged.objects
    actors = (objects.get(action.arguments[0]) for action in actions if action.arguments)
    components = dict.fromkeys(actor.component for actor in actors if actor and actor.component)
    return Preview("can", tuple(called.values()), tuple(components))

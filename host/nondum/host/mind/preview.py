"""What the robot would do for a goal that is not given yet, to be read back to who asked for it."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

from nondum.host.mind import short_names
from nondum.host.mind.composition import Composition
from nondum.host.mind.lack import Need
from nondum.host.mind.offers import Outlook
from nondum.planning.ground.ground import ground
from nondum.planning.merge.goal import Goal
from nondum.planning.search import solve
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
    """The steps of a plan that was found now; once the goal is given, the host may find another."""
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
    outlook: Outlook,
    bare_facts: frozenset[str],
    names: Mapping[str, str],
) -> Preview:
    """Plan for a goal beside all that is pursued. `bare_facts` are those that hold while nothing
    runs, `names` short ones of units. It takes its time, so call it in a thread."""
    now, why = outlook.of(goal)
    if now == "cannot":
        return Preview(now, needs=why.needs)
    if now == "unknown" or (now == "holds" and goal.kind != "do"):
        return Preview(now)
    until_s = time.monotonic() + SEARCH_S
    task = ground(composition.merged, bare_facts, goal.expr)
    answer = solve(task, lambda: time.monotonic() > until_s)
    match answer:
        case AlreadyTrue():
            return Preview("holds")
        case Plan(steps):
            return _planned([task.actions[index] for index in steps], composition, names)
        case Unsolvable():
            return Preview("cannot")
    return Preview("unknown")


def _planned(
    actions: list[GroundAction], composition: Composition, names: Mapping[str, str]
) -> Preview:
    called = short_names.steps((action.name for action in actions), names)
    objects = composition.merged.objects
    actors = (objects.get(action.arguments[0]) for action in actions if action.arguments)
    components = dict.fromkeys(actor.component for actor in actors if actor and actor.component)
    return Preview("can", tuple(called.values()), tuple(components))

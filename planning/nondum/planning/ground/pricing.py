"""Which of two equally cheap alternatives is taken: costs first, then whose they are."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

from nondum.planning.merge.contribution import Contribution
from nondum.sdk.planner import GroundTask, Plan

SCALE = 10_000
"""What one unit of cost weighs, so that no plan of a hundred steps is dearer for whose it is."""
_OF_PEER = 50
_MOST = 99


def handicaps(contributions: Iterable[Contribution], self_host: str) -> dict[str, int]:
    """Unit → what it adds to the price of its actions: peers' after this host's, then by rank."""
    found: dict[str, int] = {}
    ordered = sorted(contributions, key=lambda c: (c.host != self_host, c.rank, c.component))
    for place, contribution in enumerate(ordered):
        far = 0 if contribution.host == self_host else _OF_PEER
        for unit in contribution.units:
            found[unit.object] = min(far + place, _MOST)
    return found


def priced(task: GroundTask, handicap: Mapping[str, int]) -> GroundTask:
    """The same task with costs that also tell alternatives apart which cost the same."""
    actions = (
        replace(action, cost=action.cost * SCALE + handicap.get(actor, 0))
        for action in task.actions
        for actor in (action.arguments[0] if action.arguments else "",)
    )
    return replace(task, actions=tuple(actions))


def at_own_cost(task: GroundTask, plan: Plan) -> Plan:
    """A plan for a priced task with the cost that it has in `task`."""
    return replace(plan, cost=sum(task.actions[step].cost for step in plan.steps))

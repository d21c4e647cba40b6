"""From schemas and facts to a ground task: only actions that can be reached and can help.

In an open world static facts stay in preconditions: what the planner may take for granted, the
running task must still guard.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import replace

from nondum.planning.ground.bounds import INSTANCES_LIMIT
from nondum.planning.ground.exploration import explore
from nondum.planning.ground.instances import Exploration, Row
from nondum.planning.ground.literal_task import expanded
from nondum.planning.ground.negation import positive_task
from nondum.planning.ground.relevance import helpful
from nondum.planning.ground.schema_relevance import relevant_part
from nondum.planning.merge.domain import Merged, functional_predicates
from nondum.planning.merge.goal import GoalExpr
from nondum.sdk.planner import GroundTask


def ground(
    merged: Merged,
    facts: Iterable[str],
    goal: GoalExpr,
    objects: Mapping[str, tuple[str, ...]] | None = None,
    *,
    limit: int = INSTANCES_LIMIT,
) -> GroundTask:
    """Make the task of reaching `goal` from where exactly `facts` are true.

    `facts` are all that is believed, those of `merged.init` included where they still hold; facts
    about objects that are not there are left out. `objects` (name → types) exist beside the merged
    ones. A fact that must be false somewhere has its twin in the task (`facts.twin`). The same
    input gives the same task, whatever the order of `facts`. Raises `FragmentRefused` as `explore`
    does, for more than `limit` bound actions.
    """
    part = relevant_part(merged, goal)
    known = part.known(facts)
    found = explore(part.merged, known, objects, limit=limit, wishes=part.wishes)
    found = _displaced(found, functional_predicates(merged.domain))
    literal_task = expanded(part.merged, found, goal, limit=limit)
    return positive_task(helpful(literal_task), found.table)


def _displaced(found: Exploration, functional: frozenset[str]) -> Exploration:
    """The same with every rival value among what an action deletes (rule M17 of merging)."""
    if not functional:
        return found
    rivals: defaultdict[tuple[str, Row], set[int]] = defaultdict(set)
    facts = found.table.facts
    for number in found.reached:
        predicate, row = facts[number]
        if predicate in functional and row:
            rivals[predicate, row[:-1]].add(number)

    def taken_by(add: frozenset[int]) -> set[int]:
        groups = (facts[number] for number in add)
        return set().union(*(rivals.get((name, row[:-1]), ()) for name, row in groups if row)) - add

    for instance in found.instances:
        instance.delete |= taken_by(instance.add)
        instance.changes = [
            replace(change, delete=change.delete | taken_by(change.add))
            for change in instance.changes
        ]
    return found

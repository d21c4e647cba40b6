"""Functional predicates in a task: a new value deletes all other ones (rule M17)."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace

from nondum.planning.ground.instances import Exploration


def displaced(found: Exploration, functional: frozenset[str]) -> Exploration:
    """The same with every rival value among what an action deletes."""
    if not functional:
        return found
    rivals: defaultdict[tuple[str, tuple[str, ...]], set[int]] = defaultdict(set)
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

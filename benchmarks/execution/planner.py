"""The planner that all executors share: nondum's own search, asked once for each situation."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

from benchmarks.execution.scenes import Scene

from nondum.planning.search import solve
from nondum.sdk.planner import AlreadyTrue, Plan


class Planner:
    """Plans in one scene, and remembers: every executor gets equal plans in equal situations."""

    def __init__(self, scene: Scene) -> None:
        self._task = scene.task
        self._number = {fact: index for index, fact in enumerate(scene.task.facts)}
        self._known: dict[tuple[frozenset[str], frozenset[str]], Plan | None] = {}

    def plan(self, facts: frozenset[str], excluded: Collection[str] = ()) -> Plan | None:
        """A plan from where exactly these facts hold, without the actions of these names; None if
        there is none."""
        situation = facts, frozenset(excluded)
        if situation not in self._known:
            self._known[situation] = self._searched(*situation)
        return self._known[situation]

    def _searched(self, facts: frozenset[str], excluded: frozenset[str]) -> Plan | None:
        actions = self._task.actions
        allowed = [index for index, action in enumerate(actions) if action.name not in excluded]
        task = replace(
            self._task,
            init=frozenset(self._number[fact] for fact in facts),
            actions=tuple(actions[index] for index in allowed),
        )
        match solve(task, lambda: False):
            case Plan(steps, cost):
                return Plan(tuple(allowed[step] for step in steps), cost)
            case AlreadyTrue():
                return Plan((), 0)
        return None

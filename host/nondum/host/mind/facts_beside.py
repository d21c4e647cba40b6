"""What holds while some of the behaviours that run go on, and nothing else does."""

from __future__ import annotations

from collections.abc import Iterable

from nondum.host.mind.beliefs import Beliefs
from nondum.host.mind.pursued import Pursued
from nondum.host.mind.pursued_goals import PursuedGoals


class FactsBeside:
    """Worked out once for each revision of the world."""

    def __init__(self, beliefs: Beliefs, pursued: PursuedGoals) -> None:
        self._beliefs, self._pursued = beliefs, pursued
        self._facts: dict[frozenset[str], frozenset[str]] = {}
        """Actions that go on → what holds then, at one revision of the world."""
        self._facts_of = -1

    def of(self, pursued: Iterable[Pursued]) -> frozenset[str]:
        """What holds while these goals are pursued."""
        world = self._beliefs.world
        if self._facts_of != world.revision:
            self._facts_of = world.revision
            self._facts.clear()
        runs = (run for one in pursued for run in one.tree.control.runs.values())
        going_on = frozenset(run.step.name for run in runs if not run.is_halting)
        if going_on not in self._facts:
            ended = {run.step.name for run in self._pursued.runs} - going_on
            self._facts[going_on] = world.facts_without(ended)
        return self._facts[going_on]

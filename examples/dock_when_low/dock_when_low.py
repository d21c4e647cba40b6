"""A system tree that docks when the battery is low, and then goes on with the goal."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Selector, Sequence

from nondum.host.mind.system_tree import Parts, default_tree


class BatteryIsLow(Behaviour):
    """SUCCESS while the charger tells that the battery is low."""

    def __init__(self, facts: Callable[[], frozenset[str]]) -> None:
        super().__init__("battery is low")
        self._facts = facts

    def update(self) -> Status:
        """Look at what is believed."""
        is_low = any(fact.startswith("low-battery ") for fact in self._facts())
        return Status.SUCCESS if is_low else Status.FAILURE


def tree(parts: Parts) -> Behaviour:
    """The default tree, with charging above the task."""
    charge = Sequence("charge", memory=False)
    charge.add_children([BatteryIsLow(parts.facts), parts.behaviour("dock", of="charger")])
    guarded = Selector("charge first", memory=False, children=[charge, parts.task])
    return default_tree(replace(parts, task=guarded))

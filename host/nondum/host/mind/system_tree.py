"""The system tree: what a host does at every tick, a behaviour tree that integrators can replace.

`default_tree` is monitor → world model → goals → task → people. An integrator's function gets the
`Parts` of the mind and composes them, with its own behaviours, to another tree:
`system_tree = "package:function"` in the host's configuration. It is trusted, and its leaves must
not block.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from importlib import import_module
from typing import Protocol, TypeAlias

from py_trees.behaviour import Behaviour
from py_trees.common import ParallelPolicy, Status
from py_trees.composites import Composite, Parallel

from nondum.planning.execute.task_tree import TaskTree
from nondum.sdk.errors import ConfigRefused, Problem
from nondum.sdk.frozen import frozen


class Duty(Behaviour):
    """Something short that is done at every tick; says in words what came of it."""

    def __init__(self, name: str, do: Callable[[], str]) -> None:
        super().__init__(name)
        self._do = do
        self._why = ""

    def update(self) -> Status:
        """Do it."""
        self._why = self._do()
        return Status.SUCCESS

    def why(self) -> str:
        """What came of it."""
        return self._why


class Hold(Behaviour):
    """Stands in while there is no plan to carry out: nothing is started."""

    def __init__(self, waits_for: Callable[[], str]) -> None:
        super().__init__("hold")
        self._waits_for = waits_for

    def update(self) -> Status:
        """RUNNING while something is waited for, SUCCESS while nothing is asked for."""
        return Status.RUNNING if self._waits_for() else Status.SUCCESS

    def why(self) -> str:
        """What is waited for."""
        if self.status is Status.INVALID:
            return "a plan is carried out"
        return self._waits_for() or "nothing is asked for"


class TaskSlot(Composite):
    """Where the task trees sit, the most urgent first. While there is none, or all are stuck, the
    slot holds."""

    def __init__(self, trees: Callable[[], Sequence[TaskTree]], hold: Hold) -> None:
        super().__init__("task", [hold])
        self._trees = trees
        self._hold = hold

    def tick(self) -> Iterator[Behaviour]:
        """Swap trees if there are others now, and tick them; hold where all fail."""
        trees = tuple(self._trees())
        self._swap(trees)
        self.current_child = None
        for tree in trees:
            yield from tree.tick()
        status = _together([tree.status for tree in trees])
        self.current_child = next((tree for tree in trees if tree.status is status), None)
        if status is Status.FAILURE:
            yield from self._hold.tick()
            status, self.current_child = self._hold.status, self._hold
        elif self._hold.status is not Status.INVALID:
            self._hold.stop(Status.INVALID)
        self.status = status
        yield self

    def why(self) -> str:
        """Why the slot is where it is."""
        return "; ".join(tree.why() for tree in self._trees()) or self._hold.why()

    def _swap(self, trees: Sequence[TaskTree]) -> None:
        wanted: list[Behaviour] = [*trees, self._hold]
        for child in [child for child in self.children if child not in wanted]:
            # What it ran was handed over or halted when it was replaced.
            self.remove_child(child)
        for tree in trees:
            if tree not in self.children:
                self.add_child(tree)
        self.children.sort(key=wanted.index)


def _together(statuses: Sequence[Status]) -> Status:
    """RUNNING if anything runs; else FAILURE if anything failed, or there is nothing."""
    for status in (Status.RUNNING, Status.FAILURE):
        if status in statuses:
            return status
    return Status.SUCCESS if statuses else Status.FAILURE


class MakesLeaves(Protocol):
    """Makes leaves that run behaviours of components."""

    def __call__(self, behaviour: str, *, of: str, **arguments: str) -> Behaviour:
        """A leaf that runs a behaviour of component `of` while it is ticked (`ComponentLeaf`).

        `arguments` binds parameters of the behaviour's action that are not to be chosen.
        """
        ...


@frozen
class Parts:
    """What a system tree is composed of. Each node may stand in the tree once."""

    monitor: Behaviour
    """Takes over a new composition when the catalogue has a new revision."""
    world_model: Behaviour
    """Tells what is believed; beliefs come in with the events, between ticks."""
    goals: Behaviour
    """Chooses the goal and sees to its plan."""
    task: Behaviour
    """The slot of the task trees."""
    people: Behaviour
    """Tells people."""
    behaviour: MakesLeaves
    """Makes leaves of an integrator: `parts.behaviour("dock", of="charger")`."""
    facts: Callable[[], frozenset[str]]
    """What is believed now: `"low battery" in parts.facts()`."""


SystemTree: TypeAlias = Callable[[Parts], Behaviour]


def default_tree(parts: Parts) -> Behaviour:
    """Every part at every tick, in this order."""
    return Parallel(
        "nondum",
        policy=ParallelPolicy.SuccessOnAll(synchronise=False),
        children=[parts.monitor, parts.world_model, parts.goals, parts.task, parts.people],
    )


def load_system_tree(path: str) -> SystemTree:
    """Import `package:function`. Raises `ConfigRefused` (CONFIG_SYSTEM_TREE)."""
    module, _, name = path.partition(":")
    try:
        function = getattr(import_module(module), name)
    except (ImportError, AttributeError, ValueError) as error:
        problem = Problem(
            "CONFIG_SYSTEM_TREE",
            f"cannot import {path!r} ({error})",
            where="host.system_tree",
            fix='name it "package.module:function"',
        )
        raise ConfigRefused(problem) from error
    return function  # type: ignore[no-any-return]  # an integrator's own code is trusted

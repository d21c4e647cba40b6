"""What a tick costs, by the length of the plan: nondum's task tree against py_trees' sequences."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection
from dataclasses import dataclass
from itertools import cycle

from benchmarks.measuring import Spread
from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Selector, Sequence

from nondum.planning.execute.running import RunningLeaves, RunState
from nondum.planning.execute.step import Step
from nondum.planning.execute.task_tree import TaskTree
from nondum.sdk.planner import GroundAction, GroundTask, Plan

LENGTHS = (10, 100, 1000)
OTHER_FACTS = frozenset(f"other {number}" for number in range(1000))
"""What the world holds beside what the plan is about."""
REPEATS = 7
LEAST_S = 0.02
"""Each repeat ticks for about so long."""

Tick = Callable[[], None]


@dataclass
class Lasting:
    """An action that goes on for ever. Satisfies `running.RunningAction`."""

    state: RunState = RunState.STARTING
    reason: str = ""
    progress: str = ""

    def halt(self) -> None:
        """End."""
        self.state = RunState.HALTED


@dataclass
class Still:
    """A world where everything that is started goes on. Satisfies `running.World` and `Runner`."""

    facts: frozenset[str]

    def facts_without(self, ended: Collection[str]) -> frozenset[str]:
        """Nothing here depends on what runs."""
        return self.facts

    def start(self, step: Step) -> Lasting:
        """Start it."""
        return Lasting()


class Always(Behaviour):
    """A leaf of one status."""

    def __init__(self, status: Status) -> None:
        super().__init__(status.value)
        self._always = status

    def update(self) -> Status:
        """That status."""
        return self._always


class Holds(Behaviour):
    """A guard that looks at the world."""

    def __init__(self, world: Still, fact: str) -> None:
        super().__init__(fact)
        self._world = world
        self._fact = fact

    def update(self) -> Status:
        """Whether its fact holds."""
        return Status.SUCCESS if self._fact in self._world.facts else Status.FAILURE


def chain(length: int) -> tuple[GroundTask, Plan]:
    """A plan of steps that each need the one before."""
    facts = tuple(f"done {number}" for number in range(length + 1))
    actions = tuple(
        GroundAction(f"p.do u{n}", frozenset({n}), frozenset({n + 1}), frozenset())
        for n in range(length)
    )
    task = GroundTask(facts, frozenset({0}), frozenset({length}), actions)
    return task, Plan(tuple(range(length)), length)


def nondum(length: int, *news: frozenset[str]) -> Tick:
    """A task tree whose first step runs; before each tick the next of `news` is added to what
    holds."""
    task, plan = chain(length)
    world = Still(OTHER_FACTS | {"done 0"})
    tree = TaskTree(
        task,
        plan,
        lasting=frozenset(),
        leaves=RunningLeaves(world, time.monotonic),
        kind="achieve",
        sight=lambda: (world, 0.0),
    )
    tree.tick_once()
    if not news:
        return tree.tick_once
    worlds = cycle([world.facts | some for some in news])

    def tick() -> None:
        world.facts = next(worlds)
        tree.tick_once()

    return tick


def with_memory(length: int) -> Tick:
    """A sequence with memory whose last action runs."""
    leaves = [Always(Status.SUCCESS) for _ in range(length - 1)]
    tree = Sequence("plan", memory=True, children=[*leaves, Always(Status.RUNNING)])
    tree.tick_once()
    return tree.tick_once


def guarded(length: int) -> Tick:
    """A reactive sequence whose guards all hold but the last one's, whose action runs."""
    world = Still(OTHER_FACTS | {f"done {number}" for number in range(1, length)})
    steps = [
        Selector(
            f"step {number}",
            memory=False,
            children=[Holds(world, f"done {number}"), Always(Status.RUNNING)],
        )
        for number in range(1, length + 1)
    ]
    tree = Sequence("plan", memory=False, children=steps)
    tree.tick_once()
    return tree.tick_once


WAYS: dict[str, Callable[[int], Tick]] = {
    "nondum, nothing is new": nondum,
    "nondum, news about something else": lambda n: nondum(n, frozenset(), frozenset({"rain"})),
    "nondum, a step is done or undone": lambda n: nondum(n, frozenset(), frozenset({"done 1"})),
    "py_trees sequence with memory": with_memory,
    "py_trees reactive sequence with guards": guarded,
}


def measured() -> dict[str, dict[int, Spread]]:
    """Way → length → microseconds per tick."""
    return {way: {n: spread(make(n)) for n in LENGTHS} for way, make in WAYS.items()}


def spread(tick: Tick) -> Spread:
    """Microseconds per tick, in several repeats."""
    count, took_s = 1, 0.0
    while took_s < LEAST_S:
        count *= 2
        took_s = _time_s(tick, count)
    return Spread(tuple(_time_s(tick, count) / count * 1e6 for _ in range(REPEATS)))


def _time_s(tick: Tick, count: int) -> float:
    begun = time.thread_time()
    for _ in range(count):
        tick()
    return time.thread_time() - begun

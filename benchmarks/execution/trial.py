"""One run: a robot, its troubles, an executor, and the planner that all executors share."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from random import Random
from typing import TypeAlias

from benchmarks.execution.backchained import Backchained
from benchmarks.execution.executors import Executor, Guarded, NondumTree, OpenLoop, Verdict
from benchmarks.execution.planner import Planner
from benchmarks.execution.robot import SimulatedRobot
from benchmarks.execution.scenes import Scene
from benchmarks.execution.troubles import Troubles

from nondum.sdk.planner import Plan

BUDGET = 8
"""Actions that may be started, in lengths of the first plan; moments, in twice as many."""
WAIT = 50
"""Moments on top of them, for units to come back in."""
COOL_DOWN = 10
"""Moments that an action which was given up is left out of plans."""

Make: TypeAlias = Callable[[SimulatedRobot, Plan, Executor | None], Executor]
EXECUTORS: dict[str, Make] = {
    "nondum": NondumTree,
    "open loop": OpenLoop,
    "effect guards": Guarded,
    "PA-BT": Backchained,
}


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a run ended."""

    claimed: bool
    """It said that the goal was reached."""
    true: bool
    """The goal held when it said so, or at the end."""
    actions: int
    """How many were started."""
    plans: int
    """How many plans it was given, the first one included."""
    planned: int
    """The length of the first plan."""
    ticks_us: tuple[float, ...]
    """What each tick took, of the processor's time."""

    @property
    def reached(self) -> bool:
        """It said so, and it was so."""
        return self.claimed and self.true

    @property
    def is_false(self) -> bool:
        """It said so, and it was not so."""
        return self.claimed and not self.true


@dataclass
class Trial:
    """A run under way."""

    robot: SimulatedRobot
    planner: Planner
    make: Make
    executor: Executor | None = None
    plans: int = 0
    planned: int = 0
    """The length of the first plan."""
    _excluded: dict[str, float] = field(default_factory=dict)

    def take_up(self) -> None:
        """Put an executor of another plan in the place of this one, if there is a plan."""
        now_s = self.robot.now_s
        if self.executor is not None:
            until_s = now_s + COOL_DOWN
            self._excluded.update(dict.fromkeys(self.executor.given_up, until_s))
        excluded = [name for name, until_s in self._excluded.items() if until_s > now_s]
        plan = self.planner.plan(self.robot.bare_facts, excluded)
        if plan is None:
            return
        self.plans += 1
        self.planned = self.planned or len(plan.steps)
        self.executor = self.make(self.robot, plan, self.executor)


def run(scene: Scene, planner: Planner, make: Make, troubles: Troubles, seed: int) -> Outcome:
    """Plan, tick and plan again until the executor claims success or the budget is spent."""
    robot = SimulatedRobot(scene, troubles, Random(seed))
    trial = Trial(robot, planner, make)
    trial.take_up()
    assert trial.executor is not None  # every scene has a plan
    planned, verdict, is_so = trial.planned, Verdict.UNDER_WAY, False
    ticks_us: list[float] = []
    for _ in range(2 * BUDGET * planned + WAIT):
        if verdict is Verdict.NEEDS_PLAN:
            trial.take_up()
        is_so = robot.goal_holds  # no time passes in a tick, but success may end what it is due to
        begun = time.thread_time()
        verdict = trial.executor.tick()
        ticks_us.append((time.thread_time() - begun) * 1e6)
        if verdict is Verdict.REACHED or robot.started > BUDGET * planned:
            break
        robot.moment()
    return Outcome(
        verdict is Verdict.REACHED,
        is_so,
        robot.started,
        trial.plans,
        planned,
        tuple(ticks_us),
    )

"""A simulated robot in a simulated world: it knows all that is so, and carries actions out."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass, field
from random import Random

from benchmarks.execution.scenes import Scene
from benchmarks.execution.troubles import Troubles

from nondum.planning.execute.running import RunState
from nondum.planning.execute.step import Step

SHORTEST_LOSS, LONGEST_LOSS = 3, 8
"""Moments that a unit is away."""


@dataclass(slots=True)
class SimulatedAction:
    """One started action. Satisfies `running.RunningAction`."""

    step: Step
    robot: SimulatedRobot
    state: RunState = RunState.STARTING
    reason: str = ""
    progress: str = ""

    def halt(self) -> None:
        """End at once."""
        if not self.state.has_ended:
            self.come_to(RunState.HALTED)

    def come_to(self, state: RunState, reason: str = "") -> None:
        """Be in another state, with all that this means for the world."""
        self.state, self.reason = state, reason
        self.robot.changed()


@dataclass
class SimulatedRobot:
    """Satisfies `running.Runner` and `running.World`: what is believed is what is so."""

    scene: Scene
    troubles: Troubles
    random: Random
    now_s: float = 0.0
    started: int = 0
    _base: set[str] = field(default_factory=set)
    _running: list[SimulatedAction] = field(default_factory=list)
    _lost: dict[str, int] = field(default_factory=dict)
    _facts: frozenset[str] = frozenset()
    _is_stale: bool = True

    def __post_init__(self) -> None:
        self._base |= self.scene.start
        task, lasting = self.scene.task, self.scene.lasting
        self._others_actions = [
            Step.from_action(task, action, lasting=False)
            for action in task.actions
            if action.schema not in lasting
        ]

    # World

    @property
    def facts(self) -> frozenset[str]:
        """All that holds; the same object until something changes."""
        if self._is_stale:
            found = self._holding(self._established())
            self._facts = self._facts if found == self._facts else found
            self._is_stale = False
        return self._facts

    def changed(self) -> None:
        """Look at everything again when facts are asked for."""
        self._is_stale = True

    @property
    def bare_facts(self) -> frozenset[str]:
        """What would hold if no lasting behaviour ran: what plans start from."""
        return frozenset(self._base)

    def facts_without(self, ended: Collection[str]) -> frozenset[str]:
        """What would hold if these lasting behaviours had ended."""
        if not ended:
            return self.facts
        return self._holding(a for a in self._established() if a.step.name not in ended)

    @property
    def goal_holds(self) -> bool:
        """Whether the goal is reached in truth: what a lasting behaviour gives counts only where it
        has all that it needs to go on."""
        established = self._established()
        facts = self._base.difference(*(a.step.delete for a in established))
        while able := [a for a in established if a.step.guard <= facts]:
            facts.update(*(a.step.add for a in able))
            established = [a for a in established if a not in able]
        return self.scene.goal <= facts

    # Runner

    def start(self, step: Step) -> SimulatedAction:
        """Start an action; what is not possible fails at once."""
        self.started += 1
        running = SimulatedAction(step, self)
        if step.precondition <= self.facts:
            self._running.append(running)
        else:
            running.come_to(RunState.FAILED, "it is not possible now")
        return running

    def halt_all(self) -> None:
        """End everything."""
        for running in self._running:
            running.halt()

    # Time

    def moment(self) -> None:
        """Let time pass: what runs gets on, and what may go wrong does."""
        self.now_s += 1.0
        self._come_back()
        if self._happens(self.troubles.changes):
            self._let_other_agents_act()
        if self._happens(self.troubles.losses):
            self._lose_a_unit()
        for running in self._running:
            self._get_on(running)
        self._running = [a for a in self._running if not a.state.has_ended]

    def _get_on(self, running: SimulatedAction) -> None:
        step = running.step
        if running.state is RunState.ESTABLISHED:
            if not step.guard <= self.facts:
                running.come_to(RunState.FAILED, "it lacks what it needs")
            elif self._happens(self.troubles.deaths):
                running.come_to(RunState.FAILED, "it died")
        elif running.state is RunState.STARTING:
            if not step.precondition <= self.facts:
                running.come_to(RunState.FAILED, "it became impossible")
            elif step.lasting:
                running.come_to(RunState.ESTABLISHED)
            else:
                running.come_to(RunState.SUCCEEDED)
                if not self._happens(self.troubles.silent):
                    self._apply(step)

    def _apply(self, step: Step) -> None:
        self._base -= step.delete
        self._base |= step.add
        self.changed()

    def _let_other_agents_act(self) -> None:
        possible = [s for s in self._others_actions if s.precondition <= self._base]
        if possible:
            self._apply(self.random.choice(possible))

    def _lose_a_unit(self) -> None:
        units = sorted(f.removeprefix("ready ") for f in self._base if f.startswith("ready "))
        if not units:
            return
        unit = self.random.choice(units)
        self._lost[unit] = self.random.randint(SHORTEST_LOSS, LONGEST_LOSS)
        self._base.discard(f"ready {unit}")
        self.changed()
        for running in self._running:
            if running.step.actor == unit and not running.state.has_ended:
                running.come_to(RunState.FAILED, "its unit is gone")

    def _come_back(self) -> None:
        for unit in list(self._lost):
            self._lost[unit] -= 1
            if not self._lost[unit]:
                del self._lost[unit]
                self._base.add(f"ready {unit}")
                self.changed()

    def _happens(self, chance: float) -> bool:
        return chance > 0 and self.random.random() < chance

    def _established(self) -> list[SimulatedAction]:
        return [a for a in self._running if a.state is RunState.ESTABLISHED]

    def _holding(self, established: Iterable[SimulatedAction]) -> frozenset[str]:
        steps = [running.step for running in established]
        facts = self._base.difference(*(step.delete for step in steps))
        return frozenset(facts.union(*(step.add for step in steps)))

"""The seam between plans and behaviours: who starts an action, and what is known while it runs.

An action runs for a leaf of a behaviour tree, and only while this leaf is ticked.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from enum import Enum
from typing import Protocol

from nondum.planning.execute.step import Step

LEASE_S = 3.0
"""How long a behaviour runs on after the last tick of its leaf."""


class RunState(Enum):
    """How far a started action is."""

    STARTING = "starting"
    """Asked to run. A finishing one stays here until it ends."""
    ESTABLISHED = "established"
    """A lasting one whose effects hold now."""
    SUCCEEDED = "succeeded"
    FAILED = "failed"
    HALTED = "halted"
    """Ended because it was asked to."""
    GONE = "gone"
    """Ended because its component was pulled or replaced: no failure of the action."""

    @property
    def has_ended(self) -> bool:
        """Whether nothing of it runs any more."""
        return self not in (RunState.STARTING, RunState.ESTABLISHED)


class RunningAction(Protocol):
    """One started action. Its state changes between ticks, never by itself within one."""

    @property
    def state(self) -> RunState:
        """How far it is."""
        ...

    @property
    def reason(self) -> str:
        """Why it ended, in the author's words if it failed; what it answered, if it succeeded."""
        ...

    @property
    def progress(self) -> str:
        """How far it says it is; whenever that changes, it has got on."""
        ...

    def halt(self) -> None:
        """Ask it to end. Returns at once; asking again is harmless."""
        ...


class Runner(Protocol):
    """Starts actions."""

    def start(self, step: Step) -> RunningAction:
        """Start a step's action. Never blocks and never raises: what cannot start has FAILED."""
        ...


class World(Protocol):
    """What is believed at one moment."""

    @property
    def facts(self) -> frozenset[str]:
        """Every fact that holds, the effects of established lasting behaviours included. The same
        object is returned until something changes."""
        ...

    def facts_without(self, ended: Collection[str]) -> frozenset[str]:
        """The facts that would hold if the lasting behaviours of these names had ended: what they
        add is gone unless it has another source, what they delete is back."""
        ...


@dataclass(slots=True)
class NotStarted:
    """An action that its leaf has not started yet. Satisfies `RunningAction`."""

    state: RunState = RunState.STARTING
    reason: str = ""
    progress: str = ""

    def halt(self) -> None:
        """It never starts."""
        self.state = RunState.HALTED


@dataclass(slots=True)
class Run:
    """An action that a task tree runs."""

    step: Step
    started_s: float
    action: RunningAction = field(default_factory=NotStarted)
    """The leaf of the step starts it, and halts it."""
    established_s: float | None = None
    """When it was first seen established."""
    halted_because: str = ""
    """Why it was asked to end; from then on nothing counts on it."""
    ineffective_s: float | None = None
    """Since when it is established and yet its effects do not hold."""
    progressed_s: float = field(init=False)
    """When it was started, or last seen to get on."""
    _progress: str = field(init=False, default="")

    def __post_init__(self) -> None:
        self.progressed_s = self.started_s

    @property
    def is_started(self) -> bool:
        """Whether a leaf has started it."""
        return not isinstance(self.action, NotStarted)

    @property
    def is_halting(self) -> bool:
        """Whether it was asked to end."""
        return bool(self.halted_because)

    @property
    def is_pending(self) -> bool:
        """Whether its effects are still to come."""
        return not self.is_halting and self.action.state is RunState.STARTING

    @property
    def is_established(self) -> bool:
        """Whether its effects are there to be counted on."""
        return not self.is_halting and self.action.state is RunState.ESTABLISHED

    def watch(self, now_s: float) -> None:
        """Take notice of how far it says it is."""
        if self.action.progress != self._progress:
            self._progress, self.progressed_s = self.action.progress, now_s

    def halt(self, because: str) -> None:
        """Count on it no more: its leaf is to halt it. The first reason stays."""
        if not self.is_halting:
            self.halted_because = because


class RunningLeaves:
    """Starts behaviours for leaves, and halts a behaviour whose leaf is no longer ticked.

    Nothing else starts a behaviour (`tests/test_layout.py`).
    """

    def __init__(self, runner: Runner, now_s: Callable[[], float]) -> None:
        self._runner = runner
        self._now_s = now_s
        self._ticked: dict[int, tuple[Step, RunningAction, float]] = {}

    def __len__(self) -> int:
        """How many behaviours run for leaves that were ticked in the last `LEASE_S`."""
        return len(self._ticked)

    def start(self, step: Step) -> RunningAction:
        """Start a step's action for the leaf that calls."""
        action = self._runner.start(step)
        self.tick(step, action)
        return action

    def tick(self, step: Step, action: RunningAction) -> None:
        """Note that an action's leaf was ticked: for `LEASE_S` from now the action may run."""
        if action.state.has_ended:
            self._ticked.pop(id(action), None)
        else:
            self._ticked[id(action)] = step, action, self._now_s()

    def expire(self) -> tuple[Step, ...]:
        """Halt every action whose leaf was not ticked for `LEASE_S`. Returns their steps."""
        now_s = self._now_s()
        halted = []
        for key, (step, action, ticked_s) in list(self._ticked.items()):
            if action.state.has_ended:
                del self._ticked[key]
            elif now_s - ticked_s > LEASE_S:
                del self._ticked[key]
                action.halt()
                halted.append(step)
        return tuple(halted)

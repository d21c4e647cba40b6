"""Behaviours that run for leaves of a behaviour tree, and only while these leaves are ticked."""

from __future__ import annotations

from collections.abc import Callable

from nondum.planning.execute.running import Runner, RunningAction
from nondum.planning.execute.step import Step

LEASE_S = 3.0
"""How long a behaviour runs on after the last tick of its leaf."""


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

"""What one tick took down: the behaviours it asked to end, and those it found ended.

A recomposition can take several behaviours down together. That it was one decision, and why each of
them had to end, is what the journal keeps of it.
"""

from __future__ import annotations

from collections.abc import Iterable

from nondum.host.core.events.behaviours import BehavioursHalted
from nondum.planning.execute.running import Run, RunState


class Halts:
    """Compares the runs after each tick with those after the tick before."""

    def __init__(self) -> None:
        # By identity: the same action may be run again.
        self._up: dict[int, Run] = {}
        self._down: dict[int, Run] = {}

    def after(self, tick: int, runs: Iterable[Run]) -> BehavioursHalted | None:
        """What went down in the tick of that number, now that `runs` are left; None: nothing.

        A behaviour that ended because its work was done is not told.
        """
        left = {id(run): run for run in runs}
        known = self._up | {key: run for key, run in left.items() if key not in self._down}
        down = {key: run for key, run in known.items() if run.is_halting or _is_lost(run)}
        self._up = {key: run for key, run in left.items() if key in known and key not in down}
        self._down = {key: run for key, run in (self._down | down).items() if key in left}
        halted = {run.step.name: run.halted_because for run in down.values() if run.is_halting}
        lost = {run.step.name: _how(run) for run in down.values() if not run.is_halting}
        return BehavioursHalted(tick, halted, lost) if down else None


def _is_lost(run: Run) -> bool:
    is_done = run.action.state is RunState.SUCCEEDED and not run.step.lasting
    return run.action.state.has_ended and not is_done


def _how(run: Run) -> str:
    return run.action.reason or f"it {run.action.state.value} by itself"

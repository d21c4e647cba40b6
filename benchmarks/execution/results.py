"""What many runs come to."""

from __future__ import annotations

import statistics
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from benchmarks.execution.trial import Outcome
from benchmarks.measuring import percentile


@dataclass(frozen=True, slots=True)
class Cell:
    """The runs of one executor in one scene under one kind of trouble."""

    scene: str
    trouble: str
    executor: str
    outcomes: tuple[Outcome, ...]


@dataclass(frozen=True, slots=True)
class Figures:
    """Some runs in numbers."""

    runs: int
    reached: int
    false: int
    stuck: int
    actions: float
    """Started, in lengths of the first plan; the mean."""
    plans: float
    """The mean."""
    tick_us: float
    """The median of all ticks."""
    quick_us: float
    slow_us: float
    """Nine in ten ticks take no longer; one in ten is quicker than `quick_us`."""


@dataclass(frozen=True, slots=True)
class Results:
    """Everything that was run."""

    cells: tuple[Cell, ...]

    def of(self, executor: str, *, scene: str = "", trouble: str = "") -> Figures:
        """The runs of an executor: of one scene and trouble, or of all."""
        outcomes = [
            outcome
            for cell in self.cells
            if cell.executor == executor
            and scene in ("", cell.scene)
            and trouble in ("", cell.trouble)
            for outcome in cell.outcomes
        ]
        return figures(outcomes)

    def lengths(self) -> Iterator[tuple[str, int]]:
        """Each scene and the length of its first plan."""
        lengths = {cell.scene: cell.outcomes[0].planned for cell in self.cells}
        yield from lengths.items()


def figures(outcomes: Sequence[Outcome]) -> Figures:
    """At least one run in numbers."""
    ticks_us = [tick for outcome in outcomes for tick in outcome.ticks_us]
    return Figures(
        runs=len(outcomes),
        reached=sum(outcome.reached for outcome in outcomes),
        false=sum(outcome.is_false for outcome in outcomes),
        stuck=sum(not outcome.claimed for outcome in outcomes),
        actions=statistics.mean(outcome.actions / outcome.planned for outcome in outcomes),
        plans=statistics.mean(outcome.plans for outcome in outcomes),
        tick_us=percentile(ticks_us, 50),
        quick_us=percentile(ticks_us, 10),
        slow_us=percentile(ticks_us, 90),
    )

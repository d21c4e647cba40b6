"""What a run finds out, and what follows from it."""

from __future__ import annotations

import statistics
from collections.abc import Iterable
from dataclasses import dataclass, field

from benchmarks.planning.contenders import NO_PLAN, PLAN, REFUSED


@dataclass(frozen=True, slots=True)
class Attempt:
    """One contender at one problem."""

    problem: str
    group: str
    contender: str
    said: str
    """`plan`, `no plan`, `gave up` (out of time, too) or `refused`."""
    took_s: float
    """From the start of its process to its end."""
    phases: dict[str, float] = field(default_factory=dict)
    """Phase → seconds, for those that it got through."""
    steps: int = 0
    cost: int = 0
    is_valid: bool = True
    """Whether the plan, if it has one, does what it says."""
    why: str = ""

    @property
    def is_solved(self) -> bool:
        """Whether it has a plan that is right."""
        return self.said == PLAN and self.is_valid


@dataclass(frozen=True, slots=True)
class Results:
    """All attempts of one run."""

    attempts: tuple[Attempt, ...]

    @property
    def contenders(self) -> list[str]:
        """In the order in which they were measured."""
        return list(dict.fromkeys(attempt.contender for attempt in self.attempts))

    @property
    def groups(self) -> list[str]:
        """The domains."""
        return list(dict.fromkeys(attempt.group for attempt in self.attempts))

    def of(self, contender: str, group: str | None = None) -> list[Attempt]:
        """A contender's attempts, at one domain or all."""
        return [
            attempt
            for attempt in self.attempts
            if attempt.contender == contender and group in (None, attempt.group)
        ]

    def solved(self, contender: str, within_s: float = float("inf")) -> set[str]:
        """The problems that it has a right plan for."""
        return {a.problem for a in self.of(contender) if a.is_solved and a.took_s <= within_s}

    def wrong_claims(self, contender: str) -> list[str]:
        """Problems that it says have no plan, and that somebody else has a right plan for."""
        somebody = set().union(*(self.solved(other) for other in self.contenders))
        return [
            a.problem for a in self.of(contender) if a.said == NO_PLAN and a.problem in somebody
        ]

    def invalid(self, contender: str) -> list[str]:
        """Problems that it has a wrong plan for."""
        return [a.problem for a in self.of(contender) if a.said == PLAN and not a.is_valid]

    def refused(self, contender: str) -> list[str]:
        """Problems that it does not read."""
        return [a.problem for a in self.of(contender) if a.said == REFUSED]

    def by_all(self, contenders: Iterable[str]) -> set[str]:
        """The problems that each of them solves."""
        return set.intersection(*(self.solved(contender) for contender in contenders))

    def times(self, contender: str, problems: set[str]) -> list[float]:
        """How long it took for each of some problems."""
        return [a.took_s for a in self.of(contender) if a.problem in problems]

    def phase(self, contender: str, phase: str) -> list[float]:
        """How long one phase took, wherever it was got through."""
        return [a.phases[phase] for a in self.of(contender) if phase in a.phases and a.is_solved]

    def dearness(self, contender: str) -> list[float]:
        """The cost of each of its plans as a multiple of the cheapest that anybody has."""
        cheapest: dict[str, int] = {}
        for attempt in self.attempts:
            if attempt.is_solved:
                known = cheapest.get(attempt.problem, attempt.cost)
                cheapest[attempt.problem] = min(known, attempt.cost)
        return [
            a.cost / cheapest[a.problem]
            for a in self.of(contender)
            if a.is_solved and cheapest[a.problem]
        ]


def middle(values: list[float], spec: str) -> str:
    """Median, lowest and highest; a dash where there are none."""
    if not values:
        return "-"
    return f"{statistics.median(values):{spec}} ({min(values):{spec}}-{max(values):{spec}})"

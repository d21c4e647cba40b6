"""Whether a run passes, judged from what it found."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from tests.runner import report, unstable
from tests.runner.budget import Spent
from tests.runner.job import Done
from tests.runner.result import Result


@dataclass(frozen=True, slots=True)
class Findings:
    """All that a verdict rests on."""

    results: tuple[Result, ...]
    """Of all sessions, each test once."""
    died: tuple[Done, ...] = ()
    """Jobs that failed otherwise than by a test."""
    passed_alone: tuple[Result, ...] = ()
    """Of those that failed, what passed when it was run again."""
    folders: tuple[Spent, ...] = ()
    is_judged: bool = False
    """Whether this machine is fast and idle enough for the budgets."""
    refused_skips: tuple[Result, ...] = ()
    """Skipped tests that should have run here."""

    @property
    def failed(self) -> tuple[Result, ...]:
        """Tests that failed for good."""
        forgiven = self.unstable
        return tuple(r for r in self.results if r.outcome == "failed" and r not in forgiven)

    @property
    def unstable(self) -> tuple[Result, ...]:
        """Tests that are named and do not fail the run; none, if they are too many."""
        return self.passed_alone if len(self.passed_alone) <= unstable.MOST else ()

    @property
    def beyond(self) -> tuple[Spent, ...]:
        """Folders that took too long."""
        return tuple(row for row in self.folders if row.is_beyond and self.is_judged)

    @property
    def is_green(self) -> bool:
        """Whether the run passes."""
        return not (self.failed or self.died or self.beyond or self.refused_skips)

    def lines(self, evidence: object) -> Iterator[str]:
        """What fails the run, what is unstable, and the sum as the last line."""
        yield from report.failures(self.failed, self.died)
        for row in self.beyond:
            budget = "has no budget" if row.budget_s is None else f"budget {row.budget_s:.0f} s"
            yield f"FAILED {row.folder}: took {row.seconds:.0f} s, {budget} (tests/budget.toml)"
        for one in self.refused_skips:
            yield f"FAILED {one.test}: skipped, not in tests/hardware.toml: {one.reason}"
        for one in self.passed_alone:
            yield f"UNSTABLE {one.test} (evidence: {one.folder or evidence})"
        more = len(self.died) + len(self.beyond) + len(self.refused_skips)
        yield report.total(self.results, self.unstable, more)

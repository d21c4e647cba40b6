"""Actions that failed too often: left out of plans for a while, and why."""

from __future__ import annotations

from collections.abc import Callable

from nondum.planning.execute.attempts import Setbacks
from nondum.planning.execute.plan_executive import PlanExecutive


class Exclusions:
    """Of one mind, over all its goals."""

    def __init__(self, now_s: Callable[[], float]) -> None:
        self._now_s = now_s
        self.setbacks = Setbacks()
        """What is remembered from task to task."""
        self._until_s: dict[str, float] = {}
        self._failures: dict[str, str] = {}

    @property
    def excluded(self) -> frozenset[str]:
        """The actions that failed too often to be planned with for now."""
        now_s = self._now_s()
        return frozenset(name for name, until_s in self._until_s.items() if until_s > now_s)

    @property
    def failures(self) -> dict[str, str]:
        """The actions that are excluded, and how they failed."""
        return {name: self._failures.get(name, "") for name in sorted(self.excluded)}

    @property
    def all_failures(self) -> dict[str, str]:
        """How actions failed that were ever excluded."""
        return dict(self._failures)

    def note(self, control: PlanExecutive) -> None:
        """Exclude the actions that a plan has tried in vain."""
        now_s = self._now_s()
        for name in control.exhausted:
            self._failures[name] = control.attempts.given_up(name) or ""
            if self._until_s.get(name, 0.0) <= now_s:
                attempts = control.attempts
                reason, failures = attempts.last_failure(name), attempts.count(name)
                setback = self.setbacks.note(name, failures, reason)
                self._until_s[name] = now_s + setback.cool_down_s

    def clear(self) -> None:
        """Other components are here: what an action failed for may be another now."""
        self._until_s.clear()
        self.setbacks.clear()

"""How often an action was tried in vain, and how long to wait before calling it in vain."""

from __future__ import annotations

from dataclasses import dataclass, field

from nondum.planning.running import Run
from nondum.sdk.errors import Problem


@dataclass(frozen=True, slots=True)
class Patience:
    """When to give an action up."""

    tries: int = 3
    """Failures of one action, without its effects ever holding, before it is given up."""
    settle_s: float = 2.0
    """How long effects may take to be seen after an action has succeeded or is established."""
    establish_s: float = 30.0
    """How long a lasting behaviour may show no progress before its effects hold."""
    finish_s: float = 600.0
    """How long a finishing behaviour may show no progress."""
    steady_s: float = 10.0
    """A lasting behaviour that held this long starts with a clean slate when it dies."""


@dataclass(slots=True)
class Attempts:
    """The failures of a task tree's actions since their effects last held."""

    patience: Patience
    _failures: dict[str, list[str]] = field(default_factory=dict)
    _succeeded_s: dict[str, float] = field(default_factory=dict)

    def failed(self, name: str, reason: str) -> None:
        """Count a failure."""
        self._succeeded_s.pop(name, None)
        self._failures.setdefault(name, []).append(reason)

    def succeeded(self, name: str, now_s: float) -> None:
        """An action says that it has succeeded; whether its effects hold is still to be seen."""
        self._succeeded_s[name] = now_s

    def effective(self, name: str) -> None:
        """The action's effects hold: what failed before does not count any more."""
        self._failures.pop(name, None)
        self._succeeded_s.pop(name, None)

    def is_settling(self, name: str, now_s: float) -> bool:
        """Whether effects may still come. Counts a failure where they have had their time."""
        if name not in self._succeeded_s:
            return False
        if now_s - self._succeeded_s[name] < self.patience.settle_s:
            return True
        self.failed(name, "it ended in success, but its effects do not hold")
        return False

    def overdue(self, run: Run, now_s: float) -> Problem | None:
        """What is wrong with a run that has neither come to anything nor got on for too long."""
        key = "establish_s" if run.step.lasting else "finish_s"
        limit_s: float = getattr(self.patience, key)
        if not run.is_pending or now_s - run.progressed_s < limit_s:
            return None
        due = "established" if run.step.lasting else "finished"
        return Problem(
            "BEHAVIOUR_OVERDUE",
            f"it is not {due} {limit_s:g} s after its start or its last progress",
            fix=f"see `nondum logs`; have it tell progress, or raise planning.{key}",
        )

    @property
    def is_anything_settling(self) -> bool:
        """Whether the effects of some success are still to be seen."""
        return bool(self._succeeded_s)

    def given_up(self, name: str) -> str | None:
        """Why an action is not tried any more, or None while it may be tried again."""
        reasons = self._failures.get(name, [])
        if len(reasons) < self.patience.tries:
            return None
        return f"failed {len(reasons)} times: {reasons[-1] or 'no reason given'}"

    def names(self) -> tuple[str, ...]:
        """Every action that something is remembered of."""
        return tuple(sorted({*self._failures, *self._succeeded_s}))

    def last_failure(self, name: str) -> str:
        """The last reason an action failed for, or nothing."""
        reasons = self._failures.get(name)
        return reasons[-1] if reasons else ""

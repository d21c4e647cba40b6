"""How often an action was tried in vain, and how long to wait before calling it in vain."""

from __future__ import annotations

from dataclasses import dataclass, field

from nondum.planning.execute.running import Run
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen

COOL_DOWN_S = 30.0
"""How long an action that failed again and again is left out of plans."""
LONGEST_COOL_DOWN_S = 600.0
"""The same for one that goes on failing whenever it is tried again."""


@frozen
class Patience:
    """When to give an action up."""

    tries: int = 3
    """Failures of one action, without its effects ever holding (those of a lasting one for
    `steady_s`), before it is given up. One that was given up before gets one try."""
    settle_s: float = 2.0
    """How long effects may take to be seen after an action has succeeded or is established."""
    establish_s: float = 30.0
    """How long a lasting behaviour may show no progress before its effects hold."""
    finish_s: float = 600.0
    """How long a finishing behaviour may show no progress."""
    steady_s: float = 10.0
    """A lasting behaviour that held this long starts with a clean slate when it dies."""


@frozen
class Setback:
    """An action that was given up."""

    failures: int
    """How often it has failed since it last held for a while."""
    rounds: int
    """How often it was given up meanwhile."""
    reason: str
    """Of its last failure."""

    @property
    def cool_down_s(self) -> float:
        """How long to plan without it: twice as long each time, up to `LONGEST_COOL_DOWN_S`.

        >>> [Setback(3, rounds, "").cool_down_s for rounds in (1, 2, 3, 9)]
        [30.0, 60.0, 120.0, 600.0]
        """
        return min(COOL_DOWN_S * 2.0 ** (self.rounds - 1), LONGEST_COOL_DOWN_S)


@dataclass(slots=True)
class Setbacks:
    """The actions that were given up, remembered from task to task until they hold for a while."""

    _found: dict[str, Setback] = field(default_factory=dict)

    def note(self, name: str, failures: int, reason: str) -> Setback:
        """Record that an action was given up after a number of further failures."""
        known = self._found.get(name, Setback(0, 0, ""))
        found = Setback(known.failures + failures, known.rounds + 1, reason)
        self._found[name] = found
        return found

    def of(self, name: str) -> Setback | None:
        """What is remembered of an action."""
        return self._found.get(name)

    def names(self) -> tuple[str, ...]:
        """Every action that something is remembered of."""
        return tuple(self._found)

    def forget(self, name: str) -> None:
        """The action has held for a while: it starts with a clean slate."""
        self._found.pop(name, None)

    def clear(self) -> None:
        """Other components are here: nothing of this need be so any more."""
        self._found.clear()


@dataclass(slots=True)
class Attempts:
    """The failures of a task tree's actions since their effects last held."""

    patience: Patience
    setbacks: Setbacks = field(default_factory=Setbacks)
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
        """The action's effects hold, those of a lasting one for a while: what failed before does
        not count any more."""
        self.setbacks.forget(name)
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
        reasons, before = self._failures.get(name, []), self.setbacks.of(name)
        if len(reasons) < (self.patience.tries if before is None else 1):
            return None
        times = len(reasons) + (before.failures if before else 0)
        return f"failed {times} times: {reasons[-1] or 'no reason given'}"

    def count(self, name: str) -> int:
        """How often an action has failed in this task."""
        return len(self._failures.get(name, []))

    def troubled(self) -> tuple[str, ...]:
        """Every action that has failed, in this task or before, and has not held since."""
        return tuple(sorted({*self._failures, *self.setbacks.names()}))

    def trouble(self, name: str) -> str:
        """How often an action has failed, and how the last time; empty: it has not."""
        before = self.setbacks.of(name)
        times = self.count(name) + (before.failures if before else 0)
        often = "once" if times == 1 else f"{times} times"
        return f"failed {often}: {self.last_failure(name) or 'no reason given'}" if times else ""

    def names(self) -> tuple[str, ...]:
        """Every action that something is remembered of."""
        return tuple(sorted({*self._failures, *self._succeeded_s}))

    def last_failure(self, name: str) -> str:
        """The last reason an action failed for, or nothing."""
        before = self.setbacks.of(name)
        return [before.reason if before else "", *self._failures.get(name, [])][-1]

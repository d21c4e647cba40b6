"""What is missing for a goal, as a value and in words."""

from __future__ import annotations

from collections.abc import Iterable
from enum import Enum

from nondum.planning.pddl.facts import parts
from nondum.planning.pddl.syntax import type_text
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen


class Lack(Enum):
    """What kind of thing is missing."""

    ACTION = "WHY_NO_ACTION"
    """Nothing installed makes such a fact true."""
    OBJECT = "WHY_NO_OBJECT"
    """There is nothing of a type."""
    HOST = "WHY_NOT_SO"
    """The host does not say so: not ready, not on this body, in use."""
    VALUE = "WHY_NO_VALUE"
    """A function that is added to the cost has no value, so the action cannot be taken."""
    FALSE = "WHY_NEVER_FALSE"
    """It holds, must not, and nothing ends it."""
    EXCLUDED = "WHY_EXCLUDED"
    """All is there, but a comparison or another condition rules it out."""
    CIRCLE = "WHY_CIRCLE"
    """All that could make it true needs it first."""


@frozen
class Cause:
    """One root of what cannot be reached."""

    lack: Lack
    fact: str
    """The condition that cannot be met; `?type` stands for what is not determined."""
    types: tuple[str, ...] = ()
    """For `Lack.OBJECT`: what there is none of."""
    terms: tuple[tuple[str, ...], ...] = ()
    """For `Lack.ACTION`: the types of each term that is not determined, empty for the others."""
    path: tuple[str, ...] = ()
    """The actions that lead from here to the goal, the one that reaches the goal first."""
    goal: str = ""
    """The part of the goal that it is needed for."""

    def problem(self, said: str = "") -> Problem:
        """The cause in words: what is missing, which step needs it, and what that is for; `said` is
        what is missing where more is known of it than here."""
        needed = f", which {self.path[-1]} needs" if self.path else ""
        purpose = list(reversed(self.path[:-1]))
        if self.goal and (self.path or self.goal != self.fact):
            purpose.append(f"({self.goal})")
        serves = "".join(f", for {step}" for step in purpose)
        return Problem(self.lack.value, f"{said or self.said}{needed}{serves}", fix=self._fix())

    @property
    def said(self) -> str:
        """What is missing, without what needs it."""
        match self.lack:
            case Lack.ACTION:
                return f"nothing here makes ({self.fact}) true"
            case Lack.OBJECT:
                return f"there is no {type_text(self.types)}"
            case Lack.HOST:
                return f"({self.fact}) does not hold"
            case Lack.VALUE:
                return f"({self.fact}) has no value"
            case Lack.FALSE:
                return f"({self.fact}) holds, and nothing here ends that"
            case Lack.EXCLUDED:
                return f"a condition excludes ({self.fact})"
            case Lack.CIRCLE:
                return f"whatever makes ({self.fact}) true needs it first"

    def _fix(self) -> str:
        if self.lack is not Lack.HOST:
            return ""
        return _FIXES.get(parts(self.fact)[0], "")


_FIXES = {
    "ready": "see `nondum components`: its worker or a device is missing",
    "on": "plug one in on this body",
    "idle": "halt what uses it",
    "free": "halt what uses it",
}


def distinct(causes: Iterable[Cause]) -> tuple[Cause, ...]:
    """Each thing that is missing once, told along its shortest path."""
    found: dict[tuple[object, ...], Cause] = {}
    for cause in sorted(causes, key=lambda cause: (len(cause.path), cause.path)):
        what = cause.types if cause.lack is Lack.OBJECT else cause.fact
        found.setdefault((cause.lack, what), cause)
    return tuple(found.values())

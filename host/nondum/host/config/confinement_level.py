"""The level of confinement that a host has, and why it has no higher one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Literal

from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.format import confinement
from nondum.wheelhouse.format.confinement import Level

Wanted = Level | Literal["auto"]
"""What a configuration asks for: a level, or the highest that the machine has."""

MECHANISMS: Mapping[Level, str] = {
    Level.NONE: "resource limits only",
    Level.RESTRICTED: "Landlock and filtered system calls",
    Level.SANDBOXED: "bubblewrap",
}
"""What a level is made with, as status shows it."""
A_USER_EACH = ", a user for each worker"


def parse_wanted(value: object) -> Wanted:
    """Read what a configuration asks for. Raises `ValueError`, which says what is expected."""
    return "auto" if value == "auto" else confinement.parse(value)


@frozen
class Finding:
    """What trying one level out has shown."""

    level: Level
    is_available: bool
    reason: str = ""
    """Why it is not, in words; of an available one, what it lacks."""
    fix: str = ""
    """What a person can do about that."""
    has_users: bool = False
    """Whether each worker is a separate user to the kernel."""

    @property
    def mechanism(self) -> str:
        """What the level is made with here."""
        return MECHANISMS[self.level] + (A_USER_EACH if self.has_users else "")

    def to_dict(self) -> dict[str, Any]:
        """As JSON has it."""
        return {
            "level": str(self.level),
            "mechanism": self.mechanism,
            "available": self.is_available,
            "reason": self.reason,
            "fix": self.fix,
            "users": self.has_users,
        }

    @classmethod
    def from_dict(cls, row: Mapping[str, Any]) -> Finding:
        """Read what `to_dict` made; raises `KeyError` and `ValueError`."""
        level, is_available = confinement.parse(row["level"]), bool(row["available"])
        return cls(level, is_available, row["reason"], row["fix"], bool(row.get("users")))


@frozen
class ConfinementState:
    """At which level this host's workers run, and why not at a higher one."""

    level: Level
    findings: tuple[Finding, ...] = ()
    """Highest level first; of every level that was tried."""

    @property
    def has_users(self) -> bool:
        """Whether each worker is a separate user to the kernel."""
        return any(f.has_users for f in self.findings if f.level is self.level)

    @property
    def mechanism(self) -> str:
        """What the level is made with."""
        return MECHANISMS[self.level] + (A_USER_EACH if self.has_users else "")

    def to_dict(self) -> dict[str, Any]:
        """As status has it."""
        return {
            "level": str(self.level),
            "mechanism": self.mechanism,
            "users": self.has_users,
            "missing": [f.to_dict() for f in self.findings if f.level > self.level],
        }

    def warnings(self) -> Iterator[str]:
        """What every status says of workers that are not confined."""
        if self.level is Level.NONE:
            why = "; ".join(f.reason for f in self.findings if f.level is Level.RESTRICTED)
            yield "plugins are not confined: they may do what the host's user may" + (
                f" ({why})" if why else ""
            )


def chosen(findings: tuple[Finding, ...], wanted: Wanted) -> ConfinementState:
    """The highest level that is available, or the one that was asked for if it is.

    >>> missing = Finding(Level.SANDBOXED, is_available=False, reason="no bwrap")
    >>> str(chosen((missing, Finding(Level.RESTRICTED, is_available=True)), "auto").level)
    'restricted'
    """
    usable = [f.level for f in findings if f.is_available] + [Level.NONE]
    if wanted != "auto":
        usable = [level for level in usable if level == wanted]
    level = max(usable, default=Level.NONE)
    return ConfinementState(level, findings)


def refusals(findings: tuple[Finding, ...], wanted: Wanted, minimum: Level) -> Iterator[Problem]:
    """Why this host may not start as it is configured; nothing when it may."""
    state = chosen(findings, wanted)
    if wanted != "auto" and state.level != wanted:
        yield _too_low(findings, wanted, f'[workers] confinement = "{wanted}"', state)
    elif state.level < minimum:
        where = f'[workers] minimum_confinement = "{minimum}"'
        yield _too_low(findings, minimum, where, state)


def _too_low(
    findings: tuple[Finding, ...], need: Level, where: str, state: ConfinementState
) -> Problem:
    about = [f for f in findings if f.level >= need and not f.is_available]
    reasons = "; ".join(f"{f.level}: {f.reason}" for f in about)
    fixes = [f.fix for f in about if f.fix]
    return Problem(
        "CONFINEMENT_UNAVAILABLE",
        f"workers cannot be confined as configured ({reasons or 'no such level here'})",
        where=where,
        need=f"level {need}",
        have=f"level {state.level}",
        fix="; or: ".join([*fixes, "ask for less, if plugins here can be trusted"]),
    )

"""Levels of confinement: what holds a worker, and why no more does."""

from __future__ import annotations

import enum
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from nondum.sdk.errors import Problem


class Level(enum.IntEnum):
    """How much a worker is held, as payloads ask for it."""

    LIMITS = 0
    """Resource limits and no new privileges; nothing else."""
    KERNEL = 1
    """The kernel's own means for a process that holds itself: Landlock, system calls filtered, a
    user of its own where the host is root."""
    SERVICE = 2
    """A transient service of systemd."""
    BOX = 3
    """Bubblewrap: a world of its own, in which nothing is but what was put there."""


NAMES: Mapping[Level, str] = {
    Level.LIMITS: "resource limits",
    Level.KERNEL: "Landlock and filtered system calls",
    Level.SERVICE: "systemd service",
    Level.BOX: "bubblewrap",
}
"""What levels are called in status."""

SCRATCH: Mapping[Level, str] = {level: "disk" for level in Level} | {Level.SERVICE: "memory"}
"""Where a worker's scratch folder is: in `memory`, it ends with the worker."""


@dataclass(frozen=True, slots=True)
class Finding:
    """What trying one level out has shown."""

    level: Level
    is_available: bool
    reason: str = ""
    """Why it is not, in words; of an available one, what it lacks."""
    fix: str = ""
    """What a person can do about that."""

    def to_dict(self) -> dict[str, Any]:
        """As JSON has it."""
        return {
            "level": int(self.level),
            "name": NAMES[self.level],
            "available": self.is_available,
            "reason": self.reason,
            "fix": self.fix,
        }

    @classmethod
    def from_dict(cls, row: Mapping[str, Any]) -> Finding:
        """Read what `to_dict` made; raises `KeyError` and `ValueError`."""
        return cls(Level(row["level"]), bool(row["available"]), row["reason"], row["fix"])


@dataclass(frozen=True, slots=True)
class Standing:
    """At which level this host's workers run, and why not at a higher one."""

    level: Level
    findings: tuple[Finding, ...] = ()
    """Highest level first; of every level that was tried."""

    @property
    def name(self) -> str:
        """What the level is called."""
        return NAMES[self.level]

    def to_dict(self) -> dict[str, Any]:
        """As status has it."""
        return {
            "level": int(self.level),
            "name": self.name,
            "scratch": SCRATCH[self.level],
            "missing": [f.to_dict() for f in self.findings if f.level > self.level],
        }

    def warnings(self) -> Iterator[str]:
        """What every status says of workers that are hardly held, or forget."""
        if SCRATCH[self.level] == "memory":
            yield (
                f"what plugins write to their scratch folders is in memory (level {self.level:d}, "
                f"{self.name}): it ends with their workers"
            )
        if self.level is Level.LIMITS:
            why = "; ".join(f.reason for f in self.findings if f.level is Level.KERNEL)
            yield "plugins are not confined: they may do what the host's user may" + (
                f" ({why})" if why else ""
            )


def chosen(findings: tuple[Finding, ...], wanted: Level | None) -> Standing:
    """The highest level that is available, or the one that was asked for if it is.

    >>> box = Finding(Level.BOX, is_available=False, reason="no bwrap")
    >>> chosen((box, Finding(Level.KERNEL, is_available=True)), None).level
    <Level.KERNEL: 1>
    """
    usable = [f.level for f in findings if f.is_available] + [Level.LIMITS]
    if wanted is not None:
        usable = [level for level in usable if level == wanted]
    level = max(usable, default=Level.LIMITS)
    return Standing(level, findings)


def refusals(
    findings: tuple[Finding, ...], wanted: Level | None, minimum: Level
) -> Iterator[Problem]:
    """Why this host may not start as it is configured; nothing when it may."""
    standing = chosen(findings, wanted)
    if wanted is not None and standing.level != wanted:
        yield _too_low(findings, wanted, f'[workers] confinement = "{int(wanted)}"', standing)
    elif standing.level < minimum:
        where = f"[workers] minimum_confinement = {int(minimum)}"
        yield _too_low(findings, minimum, where, standing)


def _too_low(findings: tuple[Finding, ...], need: Level, where: str, standing: Standing) -> Problem:
    about = [f for f in findings if f.level >= need and not f.is_available]
    reasons = "; ".join(f"level {int(f.level)}: {f.reason}" for f in about)
    fixes = [f.fix for f in about if f.fix]
    return Problem(
        "CONFINEMENT_UNAVAILABLE",
        f"workers cannot be confined as configured ({reasons or 'no such level here'})",
        where=where,
        need=f"level {int(need)}",
        have=f"level {int(standing.level)}",
        fix="; or: ".join([*fixes, "ask for less, if plugins here can be trusted"]),
    )

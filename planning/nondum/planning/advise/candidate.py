"""What is here, and what could be."""

from __future__ import annotations

from dataclasses import dataclass

from nondum.planning.contribution import Contribution
from nondum.sdk.errors import Problem


@dataclass(frozen=True, slots=True)
class Here:
    """A host as planning sees it now."""

    host: str
    contributions: tuple[Contribution, ...]
    facts: frozenset[str]
    """All that is believed while no lasting behaviour runs."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """A payload that is not here, as planning would see it if it were."""

    id: str
    version: str
    where: str
    """Where it was found, for people."""
    contributions: tuple[Contribution, ...]
    """Its components, as components of this host."""
    facts: frozenset[str]
    """What the host would say of their units: ready, on this body, idle, …"""
    caveats: tuple[Problem, ...] = ()
    """What would keep it, or some of it, from running here."""

    @property
    def name(self) -> str:
        """Id and version."""
        return f"{self.id} {self.version}"

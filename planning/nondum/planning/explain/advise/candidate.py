"""What is here, and what could be."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from nondum.planning.merge.contribution import Contribution
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen


@frozen
class Here:
    """A host as planning sees it now."""

    host: str
    contributions: tuple[Contribution, ...]
    facts: frozenset[str]
    """All that is believed while no lasting behaviour runs."""
    excluded: frozenset[str] = frozenset()
    """Actions that failed too often to be planned with for now."""

    def beside(self, candidates: Iterable[Candidate]) -> Here:
        """The same host with all candidates, of components that several bring only the first."""
        found = {(c.host, c.component): c for c in self.contributions}
        rank = max((c.rank for c in self.contributions), default=0) + 1
        facts = set(self.facts)
        for candidate in candidates:
            facts |= candidate.facts
            for contribution in candidate.contributions:
                key = (contribution.host, contribution.component)
                found.setdefault(key, replace(contribution, rank=rank))
        return replace(self, contributions=tuple(found.values()), facts=frozenset(facts))


@frozen
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

"""Which changes of the world a task has to look at: most are about something else."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import TypeAlias

from nondum.planning.facts import is_twin, twin
from nondum.planning.running import World
from nondum.planning.step import Step

Glimpse: TypeAlias = tuple[frozenset[str], frozenset[str]]
"""What matters and is so, and what would be so if all that is established had ended."""


class Attention:
    """Remembers what the world was like where it matters."""

    def __init__(self, steps: Iterable[Step], goal: frozenset[str]) -> None:
        """`steps` are those of the plan, and those that run without being in it."""
        named = goal.union(*(s.precondition | s.add | s.delete for s in steps))
        self._matter = named.union(twin(fact) for fact in named if is_twin(fact))
        self._seen: frozenset[str] | None = None
        self._glimpse: Glimpse | None = None

    def keep(self, world: World, established: Collection[str], *, closely: bool) -> None:
        """Remember the world as it is. `closely`: any other fact will be a change."""
        self._seen = world.facts
        self._glimpse = None if closely else self._glimpse_of(world, established)

    def is_as_before(self, world: World, established: Collection[str]) -> bool:
        """Whether nothing that matters is different from what was kept."""
        if self._seen is world.facts:
            return True
        if self._glimpse is None or self._glimpse != self._glimpse_of(world, established):
            return False
        self._seen = world.facts
        return True

    def _glimpse_of(self, world: World, established: Collection[str]) -> Glimpse:
        bare = world.facts_without(established) if established else world.facts
        return self._matter & world.facts, self._matter & bare

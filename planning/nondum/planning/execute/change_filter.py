"""Which changes of the world a task has to look at: most are about something else."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import TypeAlias

from nondum.planning.execute.running import World
from nondum.planning.execute.step import Step
from nondum.planning.pddl.facts import is_twin, twin
from nondum.sdk.frozen import frozen

Glimpse: TypeAlias = tuple[frozenset[str], frozenset[str]]
"""What matters and is so, and what would be so if all that is established had ended."""


@frozen
class Narrow:
    """A world without what does not matter. Satisfies `running.World`."""

    world: World
    whole: frozenset[str]
    """What holds in it."""
    matter: frozenset[str]
    facts: frozenset[str]
    """What matters and holds."""

    def facts_without(self, ended: Collection[str]) -> frozenset[str]:
        """What matters and would hold."""
        left = self.world.facts_without(ended)
        return self.facts if left is self.whole else self.matter & left


class ChangeFilter:
    """Remembers what the world was like where it matters."""

    def __init__(self, steps: Iterable[Step], goal: frozenset[str]) -> None:
        """`steps` are those of the plan, and those that run without being in it."""
        named = goal.union(*(s.precondition | s.add | s.delete for s in steps))
        self._matter = named.union(twin(fact) for fact in named if is_twin(fact))
        self._narrow: Narrow | None = None
        self._seen: frozenset[str] | None = None
        self._glimpse: Glimpse | None = None

    def narrowed(self, world: World) -> World:
        """The world as far as it matters."""
        narrow, whole = self._narrow, world.facts
        if narrow is None or narrow.world is not world or narrow.whole is not whole:
            narrow = self._narrow = Narrow(world, whole, self._matter, self._matter & whole)
        return narrow

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
        narrow = self.narrowed(world)
        facts = narrow.facts
        return facts, narrow.facts_without(established) if established else facts

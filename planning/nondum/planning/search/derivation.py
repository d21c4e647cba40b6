"""Derived facts over bit masks: rules in an order in which one pass settles most of them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TypeAlias

from nondum.sdk.frozen import frozen

Clause: TypeAlias = tuple[int, int, int]
"""Mask, value, head: the head is added to a state whose bits under the mask have the value."""


@frozen
class Stage:
    """Clauses that are looked at one after the other, again and again where they are cyclic."""

    clauses: tuple[Clause, ...]
    is_cyclic: bool

    def settled(self, state: int) -> int:
        """The state with what follows from it."""
        while True:
            before = state
            for mask, value, head in self.clauses:
                if state & mask == value:
                    state |= head
            if not self.is_cyclic or state == before:
                return state


@frozen
class MaskLayer:
    """A layer as masks: rules (head, body), and complements (fact, other)."""

    rules: tuple[tuple[int, int], ...]
    complements: tuple[tuple[int, int], ...]

    def cyclic_heads(self) -> int:
        """The heads that are part of a cycle, or depend on one, within the layer."""
        return _mask(head for head, _ in self._split()[1])

    def stages(self) -> Iterator[Stage]:
        """What settles the layer."""
        ordered, cyclic = self._split()
        yield Stage(tuple((body, body, head) for head, body in ordered), is_cyclic=False)
        yield Stage(tuple((body, body, head) for head, body in cyclic), is_cyclic=True)
        yield Stage(tuple((fact, 0, other) for fact, other in self.complements), is_cyclic=False)

    def _split(self) -> tuple[list[tuple[int, int]], list[tuple[int, int]]]:
        """The rules that depend on earlier ones only, in their order; and the others."""
        ordered: list[tuple[int, int]] = []
        left = list(self.rules)
        while True:
            open_heads = _mask(head for head, _ in left)
            free = [rule for rule in left if not rule[1] & open_heads]
            if not free:
                return ordered, left
            # A head is closed once all of its rules are in order: those that wait keep it open.
            ordered += free
            left = [rule for rule in left if rule[1] & open_heads]


def stages_of(layers: Sequence[MaskLayer]) -> tuple[Stage, ...]:
    """What settles all layers, with as few stages as their cycles allow."""
    stages: list[Stage] = []
    for stage in (stage for layer in layers for stage in layer.stages() if stage.clauses):
        if stages and not stages[-1].is_cyclic and not stage.is_cyclic:
            stage = Stage(stages.pop().clauses + stage.clauses, is_cyclic=False)
        stages.append(stage)
    return tuple(stages)


def _mask(bits: Iterable[int]) -> int:
    total = 0
    for bit in bits:
        total |= bit
    return total

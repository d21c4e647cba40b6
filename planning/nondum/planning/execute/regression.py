"""How much of a plan is left, seen from its end: the least rest that the world supports.

The rest of a plan is a set of its steps that is closed under "comes after". It is supported when
every fact that it needs from outside holds now. Of all supported rests the least one is taken: what
is achieved is skipped, what was undone is done again, and an empty rest means that the goal holds.
Triangle tables (Fikes, Hart and Nilsson 1972), for partial orders (Muise, McIlraith and Beck 2011).
"""

from __future__ import annotations

from collections.abc import Sequence, Set

from nondum.planning.execute.partial_order import (
    GOAL,
    CausalLink,
    PartialOrder,
    bits,
    causal_links,
    partial_order,
)
from nondum.planning.execute.step import Step
from nondum.sdk.frozen import frozen

_NO, _YES = b"01"
"""Digits of a set of steps, as it is gathered."""


@frozen
class Rest:
    """The steps that are still to do; they reach the goal from here."""

    steps: int
    """Bit mask over the plan's steps; 0: the goal holds."""


@frozen
class Stuck:
    """No rest of the plan is supported: these facts are needed and no step of it gives them."""

    missing: tuple[CausalLink, ...]
    steps: int
    """The steps that would be left if somebody gave them."""

    @property
    def facts(self) -> frozenset[str]:
        """The missing facts."""
        return frozenset(link.fact for link in self.missing)


class Regression:
    """A plan and its goal, asked again and again as the world changes."""

    def __init__(self, steps: Sequence[Step], goal: frozenset[str]) -> None:
        self.steps = tuple(steps)
        self.goal = goal
        self.links: tuple[CausalLink, ...] = causal_links(self.steps, goal)
        self.order: PartialOrder = partial_order(self.steps, self.links)
        self._needs_of: dict[int, list[CausalLink]] = {i: [] for i in range(len(self.steps))}
        self._needs_of[GOAL] = []
        self._uses_of: dict[int, list[CausalLink]] = {i: [] for i in range(len(self.steps))}
        for link in self.links:
            self._needs_of[link.consumer].append(link)
            if link.provider is not None:
                self._uses_of[link.provider].append(link)
        # Ready for `rest`, which goes through most of a plan each time that something happens.
        self._sources = [
            [(link.fact, link.provider, link) for link in self._needs_of[step]]
            for step in (*range(len(self.steps)), GOAL)  # the last one of a list has index -1, too
        ]

    def rest(self, facts: Set[str]) -> Rest | Stuck:
        """The least rest of the plan that `facts` support."""
        missing: list[CausalLink] = []
        left = bytearray(b"0" * len(self.steps))
        sources = self._sources
        pending = list(sources[GOAL])
        while True:
            while pending:
                fact, provider, link = pending.pop()
                if fact in facts:
                    continue
                if provider is None:
                    missing.append(link)
                elif left[provider] == _NO:
                    left[provider] = _YES
                    pending += sources[provider]
            todo = int(left[::-1] or b"0", 2)
            fresh = self.order.with_later(todo) & ~todo
            if not fresh:
                break
            for index in bits(fresh):
                left[index] = _YES
                pending += sources[index]
        if missing:
            missing.sort(key=lambda link: (link.consumer, link.fact))
            return Stuck(tuple(missing), todo)
        return Rest(todo)

    def needs(self, todo: int) -> frozenset[str]:
        """What a rest needs from outside itself."""
        left = f"{todo:0{len(self.steps)}b}"[::-1]
        groups = [self._sources[index] for index, is_left in enumerate(left) if is_left == "1"]
        return frozenset(
            fact
            for group in (*groups, self._sources[GOAL])
            for fact, provider, _ in group
            if provider is None or left[provider] == "0"
        )

    def needs_of(self, step: int) -> tuple[CausalLink, ...]:
        """Where each precondition of a step (of the goal for `GOAL`) comes from."""
        return tuple(self._needs_of[step])

    def uses_of(self, step: int) -> tuple[CausalLink, ...]:
        """What a step gives that a later one, or the goal, needs."""
        return tuple(self._uses_of[step])

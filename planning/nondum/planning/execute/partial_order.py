"""What in a plan's order matters: causal links, and which steps must come before which.

Two steps are ordered as the plan orders them when one gives, takes or breaks what the other needs
or gives; all others may run side by side (Muise, McIlraith and Beck 2011). Sets of steps are bit
masks, bit i for step i.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence

from nondum.planning.execute.step import Step
from nondum.sdk.frozen import frozen

GOAL = -1
"""Stands for the goal where a consumer's index is asked for."""


@frozen
class CausalLink:
    """A fact that a step (or the goal) needs, and the step that it comes from."""

    fact: str
    consumer: int
    """Index of the step that needs the fact; `GOAL` for the goal."""
    provider: int | None
    """Index of the last step before it that adds the fact; None: it holds from the start."""


@frozen
class PartialOrder:
    """The plan's steps without the order that does not matter."""

    before: tuple[int, ...]
    """For each step, the mask of all steps that must come before it."""
    after: tuple[int, ...]
    """For each step, the mask of all steps that must come after it."""

    def with_later(self, steps: int) -> int:
        """The steps of a set, and those that must come after one of them."""
        later, left = steps, steps
        while left:
            low = left & -left
            more = self.after[low.bit_length() - 1]
            later |= more
            left &= ~(more | low)
        return later

    def first_of(self, steps: int) -> Iterator[int]:
        """The steps of a set that wait for no other of the set, in the plan's order."""
        while steps:
            # Of those that are left, the lowest waits for none: what comes after others is gone.
            index = (steps & -steps).bit_length() - 1
            yield index
            steps &= ~(self.after[index] | 1 << index)

    def last_of(self, steps: int) -> Iterator[int]:
        """The steps of a set that no other of the set waits for, in the plan's order."""
        return (index for index in bits(steps) if not self.after[index] & steps)


@frozen
class Threat:
    """A step that ends a lasting one whose effect is needed afterwards."""

    fact: str
    """The guard that is deleted."""
    breaker: int
    link: CausalLink


def bits(mask: int) -> Iterator[int]:
    """Indices in a mask, ascending.

    >>> list(bits(0b1010))
    [1, 3]
    """
    while mask:
        low = mask & -mask
        yield low.bit_length() - 1
        mask ^= low


def causal_links(steps: Sequence[Step], goal: frozenset[str]) -> tuple[CausalLink, ...]:
    """Where every precondition and every goal fact comes from, by consumer, the goal last."""
    provider: dict[str, int] = {}
    links: list[CausalLink] = []
    for index, step in enumerate(steps):
        links += [CausalLink(f, index, provider.get(f)) for f in sorted(step.precondition)]
        provider.update(dict.fromkeys(step.add, index))
    links += [CausalLink(f, GOAL, provider.get(f)) for f in sorted(goal)]
    return tuple(links)


def partial_order(steps: Sequence[Step], links: Sequence[CausalLink]) -> PartialOrder:
    """Keep of the plan's order what its facts ask for."""
    adders: dict[str, int] = defaultdict(int)
    readers: dict[str, int] = defaultdict(int)
    deleters: dict[str, int] = defaultdict(int)
    users = _users(links)
    direct: list[int] = []
    before: list[int] = []
    for index, step in enumerate(steps):
        earlier = 0
        for fact in step.precondition:
            earlier |= adders[fact] | deleters[fact]
        for fact in step.add:
            earlier |= deleters[fact]
        for fact in step.delete:
            earlier |= adders[fact] | readers[fact]
            earlier |= _users_of_guarded(steps, users, readers[fact], fact, index)
        direct.append(earlier)
        before.append(_closure(earlier, before))
        bit = 1 << index
        for facts, table in (
            (step.precondition, readers),
            (step.add, adders),
            (step.delete, deleters),
        ):
            for fact in facts:
                table[fact] |= bit
    return PartialOrder(tuple(before), _after(direct))


def threats(steps: Sequence[Step], links: Sequence[CausalLink]) -> tuple[Threat, ...]:
    """Steps that break a lasting step's guard while something later still needs its effect.

    Planners see lasting behaviours as ordinary actions and can make such plans; they cannot be
    carried out.
    """
    found: list[Threat] = []
    for link in links:
        if link.provider is None or not steps[link.provider].lasting:
            continue
        guard = steps[link.provider].guard
        end = len(steps) if link.consumer == GOAL else link.consumer
        for index in range(link.provider + 1, end):
            found += [Threat(fact, index, link) for fact in sorted(guard & steps[index].delete)]
    return tuple(found)


def _users(links: Sequence[CausalLink]) -> dict[int, int]:
    """For each step, the mask of the steps that need something of it."""
    users: dict[int, int] = defaultdict(int)
    for link in links:
        if link.provider is not None and link.consumer != GOAL:
            users[link.provider] |= 1 << link.consumer
    return users


def _users_of_guarded(
    steps: Sequence[Step], users: dict[int, int], readers: int, fact: str, deleter: int
) -> int:
    """Those who use a lasting step must be done before its guard is deleted."""
    earlier = (1 << deleter) - 1
    mask = 0
    for index in bits(readers):
        if steps[index].lasting and fact in steps[index].guard:
            mask |= users.get(index, 0) & earlier
    return mask


def _closure(earlier: int, before: Sequence[int]) -> int:
    closed = earlier
    for index in bits(earlier):
        closed |= before[index]
    return closed


def _after(direct: Sequence[int]) -> tuple[int, ...]:
    after = [0] * len(direct)
    for index in reversed(range(len(direct))):
        for earlier in bits(direct[index]):
            after[earlier] |= 1 << index | after[index]
    return tuple(after)

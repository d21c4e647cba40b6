"""What a host has other hosts do for it, as far as its own orders and questions need to know."""

from __future__ import annotations

from collections.abc import AsyncIterator, Awaitable, Mapping
from typing import Any, Protocol

from nondum.host.core.row import Row


class Elsewhere(Protocol):
    """The other hosts: a seam, for a host without peers does not import what is behind it."""

    async def addressee(self, words: str) -> tuple[str | None, str]:
        """The peer whose goal words are, None for this host; and the words without its name.

        Raises `GoalRefused` (WHOSE_GOAL).
        """
        ...

    async def give(self, peer: str, words: str, priority: int = 0) -> Row:
        """Give a peer a goal: its row, as `given` has it; or that it has `stopped`.

        Raises `GoalRefused`, as the peer refuses it.
        """
        ...

    def given(self) -> list[Row]:
        """The goals that were given to peers, as they were last heard of."""
        ...

    def translations(
        self, words: str, vocabulary: Mapping[str, Any]
    ) -> Mapping[str, Awaitable[Mapping[str, Mapping[str, Any]]]]:
        """Have the components of every peer translate words: peer → component → its answer."""
        ...

    def follow(self, peer: str, id: str) -> AsyncIterator[Row]:
        """One of them, now and whenever there is news of it. Raises `GoalRefused`."""
        ...

"""What is deleted of what a host keeps beyond its need, so that it fits a quota."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from typing import Protocol

from nondum.sdk.frozen import frozen


@frozen
class Kept:
    """Something in a store."""

    sha256: str
    size: int
    """In bytes."""
    used_s: float
    """When it was last used, in seconds since 1970."""


class Prunable(Protocol):
    """A store whose contents may be deleted one by one."""

    def kept(self) -> Iterable[Kept]:
        """All that is in it."""
        ...

    def remove(self, sha256: str) -> None:
        """Delete one thing."""
        ...


def prune(stores: Sequence[Prunable], needed: Collection[str], quota: int) -> tuple[str, ...]:
    """Delete what is not `needed`, least recently used first, until what all stores hold fits
    `quota` bytes. Returns the hashes of what was deleted."""
    by_use = sorted(
        ((one, store) for store in stores for one in store.kept()),
        key=lambda pair: (pair[0].used_s, pair[0].sha256),
    )
    total = sum(one.size for one, _ in by_use)
    deleted = []
    for one, store in by_use:
        if total <= quota:
            break
        if one.sha256 not in needed:
            store.remove(one.sha256)
            total -= one.size
            deleted.append(one.sha256)
    return tuple(deleted)

"""Sends mount updates to workers: new mounts at once, removals after the next tick."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

Mounts: TypeAlias = Mapping[str, Any]
"""As `frames.mounts_of_all` makes them: frame → its parent and pose."""


class MountUpdates:
    """Tells workers of new mounts at once, and of those that are gone only after a tick.

    A behaviour that uses the place of a unit which is gone has been asked to halt by then: it is
    halted and does not fail.
    """

    def __init__(
        self, tell: Callable[[Mounts], None], after_tick: Callable[[Callable[[], None]], None]
    ) -> None:
        """`tell` tells all workers; `after_tick` calls a function once, after the next tick."""
        self._tell, self._after_tick = tell, after_tick
        self._mounts: Mounts = {}
        self._told: Mounts = {}

    def see(self, mounts: Mounts) -> None:
        """These are the mounts from now on."""
        self._mounts = mounts
        self._say({**self._told, **mounts})
        self._after_tick(self._forget)

    def _forget(self) -> None:
        if self._told != self._mounts:
            self._say(self._mounts)

    def _say(self, mounts: Mounts) -> None:
        self._told = mounts
        self._tell(mounts)

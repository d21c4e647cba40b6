"""Waiting for the catalogue to say something."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from types import TracebackType
from typing import Self, TypeVar

from nondum.host.catalogue.catalogue import Catalogue
from nondum.host.core.bus import Bus
from nondum.host.core.state import HostState

_R = TypeVar("_R")


class Watch:
    """Looks at the catalogue after each event. A context manager."""

    def __init__(self, catalogue: Catalogue, bus: Bus) -> None:
        self._catalogue, self._bus = catalogue, bus
        self._changed = asyncio.Event()

    def __enter__(self) -> Self:
        self._end = self._bus.subscribe(lambda event: self._changed.set())
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._end()

    async def until(self, found: Callable[[HostState], _R | None]) -> _R:
        """Wait until something is found in the state; what it raises ends the wait."""
        while (result := found(self._catalogue.state)) is None:
            await self._changed.wait()
            self._changed.clear()
        return result

"""What workers say: the newest lines of each component."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Iterator

from nondum.host.core.records.moment import Moment
from nondum.sdk.frozen import frozen

LINES = 1000
"""Lines that are kept of one component."""
COMPONENTS = 256
"""Components that lines are kept of."""


@frozen
class LogLine:
    """One line."""

    at: Moment
    level: str
    """`stdout`, `stderr`, or the level that the plugin logged it with."""
    text: str
    """Without control characters."""


class Logs:
    """A ring of lines per component."""

    def __init__(self) -> None:
        self._rings: dict[str, deque[tuple[int, LogLine]]] = {}
        self.version = 0
        """How many lines there were."""
        self._next = asyncio.Event()

    def add(self, component: str, line: LogLine) -> None:
        """Keep a line, in place of the oldest when there are many."""
        self.version += 1
        if component not in self._rings:
            while len(self._rings) >= COMPONENTS:
                del self._rings[next(iter(self._rings))]
            self._rings[component] = deque(maxlen=LINES)
        self._rings[component].append((self.version, line))
        self._next.set()
        self._next = asyncio.Event()

    def of(self, component: str, after: int = 0) -> tuple[LogLine, ...]:
        """The lines of a component that came after the first `after` of all, oldest first."""
        ring = self._rings.get(component, ())
        return tuple(line for number, line in ring if number > after)

    async def changed(self, since: int) -> int:
        """Wait until `version` is not `since`, and give it."""
        while self.version == since:
            await self._next.wait()
        return self.version

    def components(self) -> Iterator[str]:
        """Who has said something."""
        return iter(sorted(self._rings))

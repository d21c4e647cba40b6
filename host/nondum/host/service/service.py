"""From start to stop, as the service manager hears it: starting, ready, alive, stopping.

A sign of life is given only when the parts that do the work have got on since the last one: a loop
that turns while its manager or its mind hangs counts as hung, and systemd ends and restarts it.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable, Sequence
from typing import TypeVar

from nondum.host.core.events.daemon import HostStarted
from nondum.host.core.events.event import Event
from nondum.host.service.notify import Notifier
from nondum.sdk.frozen import frozen

SIGNS = 4
"""Signs of life within the time that is allowed for one."""
STARTING_S = 20.0
"""Between two signs of a start that goes on."""
LONGEST_START_S = 600.0
"""A start that takes longer has failed: the daemon asks for no more time."""
BETWEEN_WORDS_S = 1.0
"""The status is told no more often."""

_V = TypeVar("_V")

log = logging.getLogger(__name__)


@frozen
class Part:
    """A part of the daemon that must get on."""

    name: str
    owed: Callable[[], int]
    """How far it must have come at the next look, as of now."""
    done: Callable[[], int]
    """How far it has come."""


class Service:
    """Tells a service manager of one daemon. An asynchronous context: it starts as that begins."""

    def __init__(self, notifier: Notifier) -> None:
        self._notifier = notifier
        self._starting: asyncio.Task[None] | None = None
        self._serves = asyncio.Event()

    async def __aenter__(self) -> Service:
        if self._notifier.is_asked:
            self._notifier.status("starting")
            self._starting = asyncio.create_task(self._start())
        return self

    async def __aexit__(self, *_: object) -> None:
        await self._started()
        self._notifier.stopping()
        self._notifier.close()

    def waits(self, words: str) -> None:
        """Tell what the start waits for."""
        self._notifier.status(words)

    def on_event(self, event: Event) -> None:
        """The daemon serves once it has recovered: its socket is open before that."""
        if isinstance(event, HostStarted):
            if self._starting is not None:
                self._starting.cancel()
            self._notifier.ready()
            self._serves.set()

    async def watched(self, parts: Sequence[Part]) -> None:
        """Give signs of life until cancelled, as long as all parts get on."""
        allowed_s = self._notifier.watchdog_s
        if allowed_s is None:
            return
        owed = {part.name: part.done() for part in parts}
        hung: list[str] = []
        while True:
            behind = [part.name for part in parts if part.done() < owed[part.name]]
            if not behind:
                self._notifier.alive()
                owed = {part.name: part.owed() for part in parts}
            elif behind != hung:
                log.warning("no sign of life is given: waiting for %s", ", ".join(behind))
            hung = behind
            await asyncio.sleep(allowed_s / SIGNS)

    async def told(
        self, words: Callable[[], str], changed: Callable[[_V | None], Awaitable[_V]]
    ) -> None:
        """Once it is ready, tell what the robot is doing, whenever that is something else, until
        cancelled.

        `changed` waits until things may look different from a version of them, and gives the next.
        """
        if not self._notifier.is_asked:
            return
        await self._serves.wait()
        version, before = None, ""
        while True:
            version = await changed(version)
            if (now := words()) != before:
                self._notifier.status(now)
                before = now
            await asyncio.sleep(BETWEEN_WORDS_S)

    async def _start(self) -> None:
        for _ in range(round(LONGEST_START_S / STARTING_S)):
            self._notifier.starting(3 * STARTING_S)
            await asyncio.sleep(STARTING_S)
        log.warning("the start takes longer than %.0f s", LONGEST_START_S)

    async def _started(self) -> None:
        if self._starting is not None:
            self._starting.cancel()
            await asyncio.wait([self._starting])

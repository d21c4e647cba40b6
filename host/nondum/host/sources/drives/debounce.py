"""Debounces a drive source: a bad cable plugs and unplugs a drive ten times a second.

The first times are told at once, since people wait. A port where drives came and went a few times
within seconds is made to wait longer each time, until one stays.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from dataclasses import dataclass

from nondum.host.core.events.drives import DriveFlapping, DriveInserted, DriveRemoved
from nondum.host.core.events.event import Emit, Event
from nondum.host.sources.drives.source import DriveSource
from nondum.sdk.errors import Problem

SHORT_STAY_S = 3.0
"""A drive that was in for less has flapped."""
FREE_FLAPS = 3
"""After this many, the next drive at a port has to wait, and `DriveFlapping` is told."""
FIRST_WAIT_S, MOST_WAIT_S = 1.0, 16.0
"""What a drive has to stay, at first and at most; it doubles with each flap."""
FORGIVEN_S = 30.0
"""A port where nothing flapped for so long is as good as new."""


@dataclass
class _Port:
    """What was seen at one port."""

    flaps: int = 0
    flapped_s: float = 0.0
    is_told: bool = False
    since_s: float = 0.0
    """When what is in it came."""


@dataclass
class _Held:
    """A drive that is in and not told of yet."""

    event: DriveInserted
    timer: asyncio.TimerHandle


class Debounced:
    """Stands before another source. `now_s` is a clock that never goes back."""

    def __init__(self, source: DriveSource, now_s: Callable[[], float] = time.monotonic) -> None:
        self.kind = source.kind
        self._source, self._now_s = source, now_s
        self._ports: dict[str, _Port] = {}
        self._port_of: dict[str, str] = {}
        """Drive → port, of those that are in."""
        self._held: dict[str, _Held] = {}

    async def watch(self, emit: Emit) -> None:
        """Watch the source, until cancelled."""
        try:
            await self._source.watch(lambda event: self._pass(event, emit))
        finally:
            for held in self._held.values():
                held.timer.cancel()
            self._held.clear()

    def _pass(self, event: Event, emit: Emit) -> None:
        match event:
            case DriveInserted():
                self._on_inserted(event, emit)
            case DriveRemoved():
                self._on_removed(event, emit)
            case _:
                emit(event)

    def _on_inserted(self, event: DriveInserted, emit: Emit) -> None:
        name = event.port or event.drive
        self._forgive()
        port = self._ports.setdefault(name, _Port())
        port.since_s = self._now_s()
        self._port_of[event.drive] = name
        wait_s = _wait_s(port.flaps)
        if not wait_s:
            emit(event)
            return
        if not port.is_told:
            port.is_told = True
            emit(DriveFlapping(event.drive, (_flapping(event.drive, port.flaps),)))
        loop = asyncio.get_running_loop()
        timer = loop.call_later(wait_s, self._tell, event.drive, emit)
        self._held[event.drive] = _Held(event, timer)

    def _on_removed(self, event: DriveRemoved, emit: Emit) -> None:
        port = self._ports.get(self._port_of.pop(event.drive, ""))
        if port is not None and self._now_s() - port.since_s < SHORT_STAY_S:
            port.flaps, port.flapped_s = port.flaps + 1, self._now_s()
        held = self._held.pop(event.drive, None)
        if held is None:
            emit(event)
        else:
            held.timer.cancel()

    def _tell(self, drive: str, emit: Emit) -> None:
        """A drive has stayed as long as it had to."""
        emit(self._held.pop(drive).event)

    def _forgive(self) -> None:
        """Forget what was long ago, of ports where nothing is."""
        used, now_s = set(self._port_of.values()), self._now_s()
        for name, port in list(self._ports.items()):
            if now_s - max(port.flapped_s, port.since_s) > FORGIVEN_S:
                port.flaps, port.is_told = 0, False
                if name not in used:
                    del self._ports[name]


def _wait_s(flaps: int) -> float:
    """How long a drive has to stay before it is told.

    >>> [_wait_s(flaps) for flaps in (0, 2, 3, 4, 5, 100)]
    [0.0, 0.0, 1.0, 2.0, 4.0, 16.0]
    """
    if flaps < FREE_FLAPS:
        return 0.0
    return float(min(MOST_WAIT_S, FIRST_WAIT_S * 2 ** min(flaps - FREE_FLAPS, 10)))


def _flapping(drive: str, flaps: int) -> Problem:
    return Problem(
        "DRIVE_FLAPPING",
        f"came and went {flaps} times within seconds; it is read once it stays in",
        where=drive,
        fix="plug it in firmly, or try another port or cable",
    )

"""Tells people which payload that was here would drive a device that nothing here drives.

Not at once: a device may be there before its software. Payloads on drives are not read for it;
`nondum devices` tells of them, too.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable

from nondum.host.core.events.devices import DeviceAppeared, DeviceRemoved
from nondum.host.core.events.event import Event
from nondum.host.core.records.device import DeviceRecord
from nondum.host.core.records.snapshot import Snapshot
from nondum.host.core.status import is_at_rest
from nondum.host.sources.devices.drivers import missed, remembered
from nondum.host.sources.devices.view import claims_by_device

PATIENCE_S = 5.0
"""From a device's coming until its software is missed; again, while a payload is on its way."""


class Software:
    """Looks after devices that have come. `run` it; it hears by `on_event`."""

    def __init__(
        self,
        snapshot: Callable[[], Snapshot],
        tell: Callable[[str], None],
        patience_s: float = PATIENCE_S,
    ) -> None:
        self._snapshot, self._tell, self._patience_s = snapshot, tell, patience_s
        self._new: set[str] = set()
        self._has_new = asyncio.Event()

    def on_event(self, event: Event) -> None:
        """Note devices that come and go."""
        match event:
            case DeviceAppeared(device):
                self._new.add(device)
                self._has_new.set()
            case DeviceRemoved(device):
                self._new.discard(device)

    async def run(self) -> None:
        """Tell of devices, for ever."""
        while True:
            await self._has_new.wait()
            await asyncio.sleep(self._patience_s)
            snapshot = self._snapshot()
            if not all(map(is_at_rest, snapshot.payloads)):
                continue  # what is on its way may be what they need
            self._has_new.clear()
            new, self._new = self._new, set()
            for sentence in missed(unused(snapshot, new), remembered(snapshot)):
                self._tell(sentence)


def unused(snapshot: Snapshot, among: Iterable[str]) -> list[DeviceRecord]:
    """The devices that no component has, of those whose ids are given."""
    held, wanted = claims_by_device(snapshot), set(among)
    return [d for d in snapshot.devices if d.id in wanted and d.id not in held]

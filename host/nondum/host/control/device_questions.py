"""What people's tools may ask about devices."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Iterable
from typing import Any

from nondum.host.catalogue.catalogue import Catalogue
from nondum.host.control.arguments import Arguments
from nondum.host.control.rows import (
    peers_device_row,
)
from nondum.host.core.row import Row
from nondum.host.sources.devices import view
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen


@frozen
class DeviceQuestions:
    """Each method is a verb; none changes anything."""

    catalogue: Catalogue
    wrong_slots: Callable[[], Iterable[Problem]]
    """Of the files in device slots that stand for no device."""

    async def devices(self, arguments: Arguments) -> list[Row]:
        """What is plugged in, and who has it."""
        snapshot = self.catalogue.snapshot()
        peers = (
            (device, owner) for peer in snapshot.peers for device, owner in peer.devices.items()
        )
        own = view.rows_of(snapshot)
        return own + [peers_device_row(device, owner) for device, owner in peers]

    async def devices_why(self, arguments: Arguments) -> list[Row]:
        """Every device of this host, and how it fared with every rule of every component."""
        return view.why_rows(self.catalogue.snapshot())

    async def device_slots(self, arguments: Arguments) -> list[Row]:
        """What is wrong with files that are to stand for devices: problems."""
        return [problem.to_dict() for problem in self.wrong_slots()]

    async def known_devices(self, arguments: Arguments) -> list[Row]:
        """What was ever plugged in here, as far as is remembered; what was seen last comes last."""
        return [view.known_row(known) for known in self.catalogue.snapshot().known_devices]

    def answering(self) -> dict[str, Callable[[Arguments], Awaitable[Any]]]:
        """Verbs that answer once."""
        return {
            "device_slots": self.device_slots,
            "devices": self.devices,
            "devices_why": self.devices_why,
            "known_devices": self.known_devices,
        }

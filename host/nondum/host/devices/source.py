"""The seam that sources of devices stand behind."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from nondum.host.events import DeviceAppeared, DeviceRemoved, Emit


class DeviceSource(Protocol):
    """Tells devices that come and go."""

    async def watch(self, emit: Emit) -> None:
        """Emit `DeviceAppeared` for what is there, then what comes and goes.

        A device that changes is removed and appears again. Runs until cancelled; leaves nothing
        open then.
        """
        ...


@dataclass(frozen=True, slots=True)
class Found:
    """A device as its source sees it now."""

    node: Path
    properties: Mapping[str, str]


class Sightings:
    """What a source has told so far; tells only differences."""

    def __init__(self, emit: Emit) -> None:
        self._emit = emit
        self._known: dict[str, Found] = {}

    def see(self, device: str, found: Found | None) -> None:
        """A device is there like this, or (None) is not there."""
        known = self._known.get(device)
        if found == known:
            return
        if known is not None:
            del self._known[device]
            self._emit(DeviceRemoved(device))
        if found is not None:
            self._known[device] = found
            self._emit(DeviceAppeared(device, found.node, found.properties))

    def see_all(self, present: Mapping[str, Found]) -> None:
        """These devices are there, and no others."""
        for device in sorted(self._known.keys() | present.keys()):
            self.see(device, present.get(device))

"""The seam that sources of devices stand behind."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from nondum.host.core.events.devices import DeviceAppeared, DeviceChanged, DeviceRemoved
from nondum.host.core.events.event import Emit
from nondum.host.core.records.device import DeviceRecord


class DeviceSource(Protocol):
    """Tells devices that come and go."""

    async def watch(self, emit: Emit) -> None:
        """Emit `DeviceAppeared` for what is there, then what comes, changes and goes.

        Another device in a port is told as removal and appearance. Runs until cancelled; leaves
        nothing open then.
        """
        ...


class Sightings:
    """What a source has told so far; tells only differences."""

    def __init__(self, emit: Emit) -> None:
        self._emit = emit
        self._known: dict[str, DeviceRecord] = {}

    def see(self, device: str, found: DeviceRecord | None) -> None:
        """A device is there like this, or (None) is not there."""
        known = self._known.get(device)
        if found == known:
            return
        if known is not None and found is not None and is_same(known, found):
            self._known[device] = found
            self._emit(DeviceChanged(device, found))
            return
        if known is not None:
            del self._known[device]
            self._emit(DeviceRemoved(device))
        if found is not None:
            self._known[device] = found
            self._emit(DeviceAppeared(device, found))

    def see_all(self, present: Mapping[str, DeviceRecord]) -> None:
        """These devices are there, and no others."""
        for device in sorted(self._known.keys() | present.keys()):
            self.see(device, present.get(device))


def is_same(before: DeviceRecord, after: DeviceRecord) -> bool:
    """Whether it can be one device whose drivers came or went meanwhile: of its nodes one stayed,
    and nothing else came in its name."""
    nodes = {node.node: node.properties for node in after.nodes}
    stayed = [node for node in before.nodes if node.node in nodes]
    return before.identity == after.identity and any(
        _numbers(node.properties) == _numbers(nodes[node.node]) for node in stayed
    )


def _numbers(properties: Mapping[str, str]) -> tuple[str, ...]:
    """By which the kernel knows a node; a USB device has another DEVNUM each time it comes."""
    return tuple(properties.get(name, "") for name in ("MAJOR", "MINOR", "DEVNUM"))

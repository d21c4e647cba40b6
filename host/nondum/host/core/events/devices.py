"""Devices come and go, and are given to components."""

from __future__ import annotations

from dataclasses import field
from typing import Any

from nondum.host.core.events.event import Event
from nondum.host.core.records.device import DeviceRecord
from nondum.sdk.frozen import frozen


@frozen
class DeviceAppeared(Event):
    """A device is there."""

    device: str
    """Its id on this host: bus and port, or the name of its slot file."""
    found: DeviceRecord = field(repr=False)
    """As its source sees it."""

    def to_dict(self) -> dict[str, Any]:
        """Only what it is: all its properties stand in the catalogue."""
        nodes = [str(node.node) for node in self.found.nodes]
        return {"device": self.device, "identity": self.found.identity, "nodes": nodes}


@frozen
class DeviceChanged(Event):
    """A device that is there has other nodes or properties than before."""

    device: str
    found: DeviceRecord = field(repr=False)
    """As its source sees it now."""

    def to_dict(self) -> dict[str, Any]:
        """Only what it is, as `DeviceAppeared` has it."""
        return DeviceAppeared(self.device, self.found).to_dict()


@frozen
class DeviceRemoved(Event):
    """A device was pulled."""

    device: str


@frozen
class DeviceClaimed(Event):
    """A device was given to the component that declared a need for it."""

    device: str
    component: str
    need: str


@frozen
class DeviceReleased(Event):
    """A component lost a device, or gave it back."""

    device: str
    component: str
    need: str

"""Devices, with their nodes, and which component has which."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from nondum.sdk.frozen import frozen


@frozen
class DeviceNode:
    """What is opened to use a device, or a part of it."""

    node: Path
    properties: Mapping[str, str]
    """udev's, and those of its interface and device by which it is identified."""
    interface: str = ""
    """Number of the USB interface that it belongs to: `00`; empty: of the device as a whole."""

    @property
    def subsystem(self) -> str:
        """The kernel's kind of node."""
        return self.properties.get("SUBSYSTEM", "")


@frozen
class DeviceInterface:
    """One of the functions of a USB device."""

    number: str
    kind: str
    """Class, subclass and protocol in hexadecimal: `03:01:02`."""
    driver: str = ""
    """The kernel's; empty: none."""


@frozen
class DeviceRecord:
    """A physical device that is plugged in, wanted or not, with all its nodes."""

    id: str
    """Bus and port, `usb:1-4.2`, or the name of its slot file."""
    nodes: tuple[DeviceNode, ...]
    """At least one, those that drivers made first, the raw one of a USB device last."""
    bus: str = ""
    port: str = ""
    parent: str = ""
    """Id of the device that it is plugged into, where that is a USB device."""
    interfaces: tuple[DeviceInterface, ...] = ()
    driver: str = ""
    """The kernel's drivers of it and its interfaces."""
    vendor: str = ""
    """Hexadecimal, of USB devices."""
    product: str = ""
    serial: str = ""
    name: str = ""
    """What it, or udev's database, says that it is."""
    first_s: float = 0.0
    """When such a device was first seen on this host, in seconds since 1970."""
    since_s: float = 0.0
    """When it was plugged in, or the daemon started."""

    @property
    def identity(self) -> str:
        """What it is known by when it comes again, at another port too if it has a number."""
        if not self.vendor:
            return self.id
        kind = f"{self.bus} {self.vendor}:{self.product}"
        return f"{kind} {self.serial}" if self.serial else f"{kind} at {self.port}"


@frozen
class KnownDevice:
    """A device that was seen on this host, whether it is there or not."""

    identity: str
    name: str
    device: str
    """Id that it had when last seen."""
    first_s: float
    last_s: float
    """When it was last plugged in or pulled, in seconds since 1970."""


@frozen
class DeviceClaim:
    """A declared need of a component and the device that serves it, if one is there."""

    name: str
    match: Mapping[str, str]
    optional: bool
    device: str | None = None
    """Id of a `DeviceRecord`."""
    nodes: tuple[Path, ...] = ()
    """Its nodes that serve the need, the first of them first."""
    contested_by: tuple[str, ...] = ()
    """Components that want the same device and did not get it."""

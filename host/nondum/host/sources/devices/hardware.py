"""From what udev tells of nodes and interfaces to physical devices. Pure.

The kernel knows a camera as a USB device, two or more interfaces and several nodes. What belongs to
one device is found by its place in sysfs: below the nearest USB device, else below the nearest
device on a bus (sysfs(5), Documentation/driver-api/driver-model/bus.rst).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import field
from pathlib import Path, PurePosixPath
from typing import Any

from nondum.host.core.records.device import DeviceInterface, DeviceNode, DeviceRecord
from nondum.sdk.frozen import frozen

RAW = "usb"
"""Subsystem of the node by which a USB device is used without a driver of the kernel."""
_INSIDE = frozenset({"hid", "gpio", "iio", "serial-base", "usb-serial", "scsi", "media", "mei"})
"""Buses inside of devices: what is on them is a part of something."""
_ROOT_HUB = re.compile(r"usb[0-9]+")
_INHERITED = re.compile(r"ID_(?!PATH|INPUT|FOR_SEAT|USB_DRIVER)")
"""Properties by which a device is identified: its parts have them, too."""


@frozen
class Part:
    """Something in sysfs: a device, an interface of one, or what has a node."""

    path: str
    """In sysfs, without `/sys`."""
    subsystem: str
    kind: str = ""
    """udev's DEVTYPE: `usb_device`, `usb_interface` …"""
    is_on_bus: bool = False
    """Whether its subsystem is a bus, not a class of things that can be done with it."""
    properties: Mapping[str, str] = field(default_factory=dict)
    above: Part | None = None
    """What it is a part of, as far up as the physical device."""

    @property
    def node(self) -> str:
        """Path of its node; empty: it has none."""
        return self.properties.get("DEVNAME", "")


def lineage(part: Part) -> Iterator[Part]:
    """It, what it is a part of, and so on."""
    one: Part | None = part
    while one is not None:
        yield one
        one = one.above


def is_physical(part: Part) -> bool:
    """Whether what has this above it belongs to it, and nothing further up matters."""
    if part.subsystem == "usb":
        return part.kind == "usb_device"
    return part.is_on_bus and part.subsystem not in _INSIDE


def physical(part: Part) -> Part:
    """The device that a part belongs to; itself, if it belongs to none.

    >>> stick = Part("/devices/usb1/1-4", "usb", "usb_device")
    >>> line = Part("/devices/usb1/1-4/1-4:1.0", "usb", "usb_interface", above=stick)
    >>> physical(Part("/devices/usb1/1-4/1-4:1.0/ttyUSB0", "tty", above=line)).path
    '/devices/usb1/1-4'
    """
    line = tuple(lineage(part))
    usb = (one for one in line if one.kind == "usb_device")
    buses = (one for one in line if is_physical(one))
    return next(usb, None) or next(buses, part)


def device_id(device: Part) -> str:
    """Bus and port of a physical device.

    >>> device_id(Part("/devices/pci0/usb1/1-4/1-4.2", "usb", "usb_device"))
    'usb:1-4.2'
    """
    return f"{device.subsystem}:{PurePosixPath(device.path).name}"


def devices(parts: Iterable[Part]) -> dict[str, DeviceRecord]:
    """The physical devices that parts belong to, by id: those that have nodes."""
    groups: dict[str, list[Part]] = {}
    for part in parts:
        groups.setdefault(device_id(physical(part)), []).append(part)
    made = (record(group) for _, group in sorted(groups.items()))
    return {device.id: device for device in made if device is not None}


def record(parts: Iterable[Part]) -> DeviceRecord | None:
    """The device of all these parts of it, in whatever order they are; None: it has no node."""
    ordered = sorted(parts, key=lambda part: part.path)
    nodes = tuple(sorted((_node(part) for part in ordered if part.node), key=_order))
    if not nodes:
        return None
    device = physical(ordered[0])
    interfaces = tuple(sorted(_interfaces(ordered), key=lambda one: one.number))
    known = {**_kernels(device), **nodes[0].properties, **device.properties}
    drivers = [device.properties.get("DRIVER", ""), *(one.driver for one in interfaces)]
    return DeviceRecord(
        id=device_id(device),
        nodes=nodes,
        bus=device.subsystem,
        port=PurePosixPath(device.path).name,
        parent=_parent(device),
        interfaces=interfaces,
        driver=", ".join(dict.fromkeys(one for one in drivers if one not in ("", "usb"))),
        **described(known),
    )


def described(properties: Mapping[str, str]) -> dict[str, Any]:
    """What properties of udev say that a device is: fields of its record. Its own words come before
    those of udev's database, which may know one number for several devices.

    >>> described({"ID_VENDOR_ID": "0403", "ID_MODEL_ID": "6001", "ID_MODEL": "FT232R_UART"})
    {'vendor': '0403', 'product': '6001', 'serial': '', 'name': 'FT232R UART'}
    """

    vendor, product = properties.get("ID_VENDOR_ID", ""), properties.get("ID_MODEL_ID", "")

    def first(*names: str) -> str:
        found = (properties.get(name, "") for name in names)
        return next((one for one in found if one and one not in (vendor, product)), "")

    words = (
        first("ID_VENDOR", "ID_VENDOR_FROM_DATABASE"),
        first("ID_MODEL", "ID_V4L_PRODUCT", "ID_MODEL_FROM_DATABASE"),
    )
    return {
        "vendor": vendor,
        "product": product,
        "serial": first("ID_SERIAL_SHORT"),
        "name": " ".join(word for word in words if word).replace("_", " "),
    }


def _kernels(device: Part) -> dict[str, str]:
    """What the kernel itself says of a USB device (PRODUCT), where no udev is there to say more."""
    vendor, _, rest = device.properties.get("PRODUCT", "").partition("/")
    if device.kind != "usb_device" or not rest:
        return {}
    product = rest.partition("/")[0]
    return {"ID_VENDOR_ID": vendor.zfill(4), "ID_MODEL_ID": product.zfill(4)}


def _node(part: Part) -> DeviceNode:
    inherited = {
        key: value
        for above in reversed(tuple(lineage(part)))
        for key, value in above.properties.items()
        if above is part or _INHERITED.match(key)
    }
    return DeviceNode(Path(part.node), inherited, _interface_number(part))


def _order(node: DeviceNode) -> tuple[bool, str, list[tuple[int, str]], str]:
    """Raw nodes last, others by interface, and by name as people count."""
    pieces = re.findall(r"[0-9]+|[^0-9]+", node.node.name)
    counted = [(int(p), "") if p.isdecimal() else (-1, p) for p in pieces]
    return node.subsystem == RAW, node.interface, counted, str(node.node)


def _interfaces(parts: Iterable[Part]) -> Iterator[DeviceInterface]:
    seen: set[str] = set()
    for one in (above for part in parts for above in lineage(part)):
        if one.kind == "usb_interface" and one.path not in seen:
            seen.add(one.path)
            kind = _kind(one.properties.get("INTERFACE", ""))
            driver = one.properties.get("DRIVER", "")
            yield DeviceInterface(_interface_number(one), kind, driver)


def _interface_number(part: Part) -> str:
    for one in lineage(part):
        if one.kind == "usb_interface":
            return one.path.rpartition(".")[2].zfill(2)
    return ""


def _kind(triple: str) -> str:
    """The kernel's `14/1/0` as `0e:01:00`."""
    numbers = triple.split("/")
    return ":".join(f"{int(n):02x}" for n in numbers) if all(map(str.isdecimal, numbers)) else ""


def _parent(device: Part) -> str:
    above = PurePosixPath(device.path).parent.name
    if device.subsystem != "usb" or _ROOT_HUB.fullmatch(PurePosixPath(device.path).name):
        return ""
    return f"usb:{above}"

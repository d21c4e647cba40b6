"""Which nodes of a device serve a declared need, and which no component is given. Pure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from nondum.host.core.records.device import DeviceNode, DeviceRecord
from nondum.host.sources.devices.hardware import RAW
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.format.device_rules import NAMING_NODES, Verdict, judged, names_id

KEYBOARD, POINTER = "01", "02"
"""Protocols of a USB HID (HID 1.11, 4.3)."""
_HID, _HUB, _STORAGE = "03", "09", "08"
_DISKS = frozenset({"scsi_generic", "bsg", "nvme", "nvme-generic", "block"})
"""Subsystems whose nodes give away whole disks."""
_INPUT_SUBSYSTEMS = frozenset({"input", "hidraw"})
"""Subsystems of pointing devices: a camera's video node is none, even beside a touch node."""
_POINTS = ("ID_INPUT_MOUSE", "ID_INPUT_TOUCHPAD", "ID_INPUT_TOUCHSCREEN", "ID_INPUT_POINTINGSTICK")


@frozen
class Trial:
    """How one node fared with one need."""

    node: DeviceNode
    verdicts: tuple[Verdict, ...]
    kept_back: str
    """Why it is not given whatever the rules say; empty: nothing keeps it back."""

    @property
    def serves(self) -> bool:
        """Whether the need may have it."""
        return not self.kept_back and all(verdict.matched for verdict in self.verdicts)


def facts_of(device: DeviceRecord, node: DeviceNode) -> dict[str, Sequence[str]]:
    """What rules are compared with: properties of udev, and nondum's own words."""
    mine = [one for one in device.interfaces if node.interface in ("", one.number)]
    drivers = [one.driver for one in mine if one.driver] or [device.driver]
    words = {
        "bus": [device.bus],
        "driver": drivers,
        "interface": [one.kind for one in mine],
        "port": [device.port],
        "serial": [device.serial],
        "subsystem": [node.subsystem],
        "usb": [f"{device.vendor}:{device.product}"] if device.vendor else [],
    }
    properties = {key: [value] for key, value in node.properties.items()}
    return {**properties, **{word: [v for v in values if v] for word, values in words.items()}}


def tried(device: DeviceRecord, match: Mapping[str, str]) -> tuple[Trial, ...]:
    """Every node of a device against the rules of a need."""
    return tuple(
        Trial(node, judged(match, facts_of(device, node)), kept_back(device, node, match))
        for node in device.nodes
    )


def serving(device: DeviceRecord, match: Mapping[str, str]) -> tuple[DeviceNode, ...]:
    """The nodes of a device that serve a need: all of them are given together."""
    return tuple(trial.node for trial in tried(device, match) if trial.serves)


def chosen(device: DeviceRecord, nodes: Sequence[Path]) -> tuple[DeviceNode, ...]:
    """The nodes of a device by their paths, in its order."""
    return tuple(node for node in device.nodes if node.node in nodes)


def kept_back(device: DeviceRecord, node: DeviceNode, match: Mapping[str, str]) -> str:
    """Why a need is not given a node although its rules may match."""
    if reason := never_given(device, node):
        return reason
    if node.subsystem == RAW and not NAMING_NODES & match.keys():
        return "the raw USB node goes to who asks for subsystem = 'usb'"
    if _points(device, node) and not names_id(match):
        return "what people point with goes to who asks for it by usb or serial"
    return ""


def never_given(device: DeviceRecord, node: DeviceNode) -> str:
    """Why no component is given a node; empty: a component that asks for it may have it."""
    mine = [one for one in device.interfaces if node.interface in ("", one.number)]
    kinds = [one.kind.split(":") for one in mine if one.kind]
    if node.subsystem in _DISKS or any(kind[0] == _STORAGE for kind in kinds):
        return "it is a drive"
    if any(kind[0] == _HUB for kind in kinds):
        return "it is a hub"
    is_usb_keyboard = any((kind[0], kind[-1]) == (_HID, KEYBOARD) for kind in kinds)
    if is_usb_keyboard or any(
        other.properties.get("ID_INPUT_KEYBOARD") == "1" for other in _same_input(device, node)
    ):
        return "it is a keyboard"
    return ""


def _same_input(device: DeviceRecord, node: DeviceNode) -> Sequence[DeviceNode]:
    """The nodes that may tell what a node tells of keys: an input node is one input device's, a raw
    one its whole interface's, or all of them."""
    if node.subsystem not in (RAW, "hidraw"):
        return (node,)
    return [one for one in device.nodes if node.interface in ("", one.interface)]


def left_alone(device: DeviceRecord) -> str:
    """Why nothing of a device is ever given to anybody; empty: something of it may be."""
    reasons = [never_given(device, node) for node in device.nodes]
    return reasons[0] if all(reasons) else ""


def _points(device: DeviceRecord, node: DeviceNode) -> bool:
    """Whether people point with it: its interface says so, or udev of a node beside it."""
    for one in device.interfaces:
        kind = one.kind.split(":")
        if node.interface in ("", one.number) and (kind[0], kind[-1]) == (_HID, POINTER):
            return True
    if node.subsystem not in _INPUT_SUBSYSTEMS:
        return False
    beside = (other for other in device.nodes if other.interface == node.interface)
    return any(other.properties.get(name) == "1" for other in beside for name in _POINTS)

"""What a worker knows of its place: names, settings, devices, facts with values, frames, streams.

One per worker. Contexts read it; the session changes it as the host tells. All on the loop.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field
from pathlib import Path
from typing import Any

from nondum.sdk.description import PluginDescription
from nondum.sdk.errors import Problem, ProtocolViolation
from nondum.sdk.frozen import frozen
from nondum.sdk.geometry import FrameTree
from nondum.sdk.messages import Message, value_from_wire
from nondum.sdk.ports import InputPort, OutputPort
from nondum.sdk.valued import value_types

MOST_FAULTS = 100
"""Mistakes that one worker tells of."""

Tell = Callable[[str, Mapping[str, Any], int | None], None]


@frozen
class DeviceNode:
    """One node of a device: a camera may have two, a sound card has several."""

    node: str
    """Path by which this worker opens it."""
    properties: Mapping[str, str]
    """Its udev properties: `DEVNAME` is what it is called outside."""

    @property
    def subsystem(self) -> str:
        """The kernel's kind of node: `video4linux`, `sound`, `hidraw` …"""
        return self.properties.get("SUBSYSTEM", "")


@frozen
class Device:
    """A device that the host has granted."""

    node: str
    """Path of the device node."""
    properties: Mapping[str, str]
    """Its udev properties."""
    nodes: tuple[DeviceNode, ...] = ()
    """All nodes of it that serve the need, the first of them first; empty: the host tells of none
    but that one."""

    @classmethod
    def from_wire(cls, body: Mapping[str, Any], nodes: Any) -> Device:
        """Make one of what a host tells of it. Raises `KeyError`, `TypeError`."""
        every = tuple(DeviceNode(n["node"], dict(n["properties"])) for n in nodes or ())
        return cls(body["node"], dict(body.get("properties", {})), every)


@frozen
class Data:
    """Data that the host shows to the component: a model, a map …"""

    name: str
    kind: str
    version: str
    folder: Path
    """Read-only. What was opened can be read on when the data are gone."""
    files: tuple[Path, ...]
    """All of them, in the order of the payload that brings them."""

    @property
    def path(self) -> Path:
        """The first file; of most data, the only one."""
        return self.files[0]

    @classmethod
    def from_wire(cls, body: Mapping[str, Any]) -> Data:
        """Make one of what a host tells of it. Raises `KeyError`, `TypeError`."""
        folder = Path(body["folder"])
        files = tuple(folder / file for file in body["files"])
        return cls(body["name"], body["kind"], body["version"], folder, files)


@frozen
class Place:
    """Who and where a worker is: the host's welcome."""

    host: str
    component: str
    units: Mapping[str, str] = field(default_factory=dict)
    """Local name → object."""
    outputs: Mapping[str, str] = field(default_factory=dict)
    """Output slot → stream object."""
    settings: Mapping[str, Any] = field(default_factory=dict)
    scratch: Path = Path()
    """A folder of the component's own, emptied when it is removed."""
    devices: Mapping[str, Device] = field(default_factory=dict)
    data: Mapping[str, Data] = field(default_factory=dict)
    mounts: Mapping[str, Any] = field(default_factory=dict)
    limits: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def from_wire(cls, body: Mapping[str, Any]) -> Place:
        """Make one of a Welcome's body; other keys are for other versions.

        Raises `ProtocolViolation` (WELCOME).
        """
        try:
            return cls(
                host=body["host"],
                component=body["component"],
                units=dict(body.get("units", {})),
                outputs=dict(body.get("outputs", {})),
                settings=dict(body.get("settings", {})),
                scratch=Path(body.get("scratch", "")),
                devices={
                    name: Device.from_wire(device, body.get("device_nodes", {}).get(name))
                    for name, device in body.get("devices", {}).items()
                },
                data={need: Data.from_wire(shown) for need, shown in body.get("data", {}).items()},
                mounts=dict(body.get("mounts", {})),
                limits=dict(body.get("limits", {})),
            )
        except (KeyError, TypeError, ValueError) as error:
            problem = Problem("WELCOME", f"the host's welcome cannot be read: {error!r}")
            raise ProtocolViolation(problem) from error


class Workplace:
    """The changing part of what a worker knows."""

    def __init__(self, place: Place, tell: Tell) -> None:
        self.place = place
        self.tell = tell
        """Send an event to the host: name, body, call id."""
        self.devices = dict(place.devices)
        self.data = dict(place.data)
        self.frames = FrameTree.from_wire(place.mounts)
        self.values: dict[tuple[str, ...], Message] = {}
        """(predicate, object, …) → value of that fact."""
        self.outputs: dict[str, OutputPort] = {}
        """By stream object."""
        self._counted: tuple[float | None, Mapping[str, int]] = (None, {})
        """When `rates` was asked for before, and what had been sent by then."""
        self.value_types: Mapping[str, str] = {}
        """Predicate → the type of message that its value is, as the plugin's fragments declare."""
        self._told: set[tuple[str, str]] = set()
        self._inputs: dict[str, InputPort] = {}
        self._optional_inputs: dict[tuple[str, str], InputPort] = {}

    def declare(self, description: PluginDescription) -> None:
        """Make the ports of all that the plugin declares, and know what its facts carry."""
        self.value_types = value_types(description.fragments)
        for unit in description.units:
            for output in unit.outputs:
                stream = self.place.outputs.get(output.name, output.name)
                self.outputs[stream] = OutputPort(stream, output.type, self._on_flow)
            for slot in unit.inputs:
                self._optional_inputs[unit.name, slot.name] = InputPort()

    def update_values(self, set_: list[Any], unset: list[Any]) -> None:
        """Take over values of facts: `[[predicate, [object …], value]]`; and drop some."""
        for predicate, arguments, value in set_:
            self.values[predicate, *arguments] = value_from_wire(value)
        for predicate, arguments in unset:
            self.values.pop((predicate, *arguments), None)

    def fault(self, problem: Problem) -> bool:
        """Tell the host of a mistake of the plugin's author; each is told once, by code and place.

        Says whether it was told now.
        """
        key = problem.code, problem.where
        if key in self._told or len(self._told) >= MOST_FAULTS:
            return False
        self._told.add(key)
        self.tell("fault", {"problem": problem.to_dict()}, None)
        return True

    def output(self, name: str) -> OutputPort:
        """The port of a stream object or output slot. Raises `LookupError`."""
        stream = self.place.outputs.get(name, name)
        if stream not in self.outputs:
            raise LookupError(f"{name!r} is no output of this plugin; it has: {self._slots()}")
        return self.outputs[stream]

    def input(self, stream: str) -> InputPort:
        """The port of a stream that an action reads; made when first asked for."""
        return self._inputs.setdefault(stream, InputPort())

    def optional_input(self, slot: str, unit: str | None) -> InputPort:
        """The port of an optional input, its unit by local or object name.

        Raises `LookupError`.
        """
        local_names = {object_: local for local, object_ in self.place.units.items()}
        wanted = local_names.get(unit, unit) if unit is not None else None
        found = [
            port
            for (owner, name), port in self._optional_inputs.items()
            if name == slot and wanted in (None, owner)
        ]
        if not found:
            raise LookupError(f"no unit {wanted or ''} of this plugin has an input {slot!r}")
        return found[0]

    def input_for(self, body: Mapping[str, Any]) -> InputPort:
        """The port that a `consume` means: an optional input when it names a slot.

        Raises `LookupError`.
        """
        if body.get("slot"):
            return self.optional_input(body["slot"], body.get("unit"))
        return self.input(body["stream"])

    def remount(self, mounts: Mapping[str, Any]) -> None:
        """Take over the mount table `{frame: [parent, xyz, xyzw]}`."""
        self.frames = FrameTree.from_wire(mounts)

    def rates(self, now_s: float) -> dict[str, float]:
        """Messages a second of each stream that was sent on since this was asked before."""
        before_s, before = self._counted
        sent = {output.stream: output.sent for output in self.outputs.values() if output.sent}
        self._counted = (now_s, sent)
        news = {stream: count - before.get(stream, 0) for stream, count in sent.items()}
        if before_s is None or now_s <= before_s:
            return {}
        return {stream: count / (now_s - before_s) for stream, count in news.items() if count}

    def close(self) -> None:
        """End all streams."""
        for output in self.outputs.values():
            output.close()
        for port in (*self._inputs.values(), *self._optional_inputs.values()):
            port.disconnect()

    def _slots(self) -> str:
        return ", ".join(self.place.outputs) or "none"

    def _on_flow(self, port: OutputPort) -> None:
        self.tell("flow", {"stream": port.stream, "flowing": port.is_flowing}, None)

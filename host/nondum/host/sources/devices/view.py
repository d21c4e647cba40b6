"""What people's tools are shown of devices: plain data, one row a device, and why it is so."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any, TypeAlias

from nondum.host.core.records.device import (
    DeviceClaim,
    DeviceInterface,
    DeviceNode,
    DeviceRecord,
    KnownDevice,
)
from nondum.host.core.records.snapshot import Snapshot
from nondum.host.sources.devices.matching import Trial, left_alone, tried
from nondum.sdk.codec.values import to_plain

Row: TypeAlias = dict[str, Any]
Held: TypeAlias = Sequence[tuple[str, DeviceClaim]]
"""Components, and the claims by which they have a device."""


def rows_of(snapshot: Snapshot) -> list[Row]:
    """This host's devices, by id."""
    held = claims_by_device(snapshot)
    ordered = sorted(snapshot.devices, key=lambda device: device.id)
    return [device_row(device, held.get(device.id, ())) for device in ordered]


def device_row(device: DeviceRecord, held: Held) -> Row:
    """A device that is plugged in, and who has it. All that the catalogue has of it is in it."""
    told: Row = to_plain(device)
    first = device.nodes[0]
    contested = sorted({other for _, claim in held for other in claim.contested_by})
    return {
        **told,
        "device": device.id,
        "identity": device.identity,
        "node": str(first.node),
        "properties": dict(first.properties),
        "component": ", ".join(dict.fromkeys(component for component, _ in held)),
        "need": ", ".join(claim.name for _, claim in held),
        "contested_by": contested,
        "used_by": [
            {"component": component, "need": claim.name, "nodes": to_plain(claim.nodes)}
            for component, claim in held
        ],
        "left_alone": left_alone(device),
    }


_FIELDS = tuple(field.name for field in fields(DeviceRecord))


def device_of(row: Mapping[str, Any]) -> DeviceRecord:
    """The device of a row that another process of this host's nondum has made."""
    given = {name: row[name] for name in _FIELDS}
    nodes = tuple(
        DeviceNode(Path(n["node"]), n["properties"], n["interface"]) for n in row["nodes"]
    )
    interfaces = tuple(DeviceInterface(**one) for one in row["interfaces"])
    return DeviceRecord(**{**given, "nodes": nodes, "interfaces": interfaces})


def known_row(known: KnownDevice) -> Row:
    """A device that was here."""
    told: Row = to_plain(known)
    return told


def claims_by_device(snapshot: Snapshot) -> Mapping[str, Held]:
    """Device → who has it or parts of it."""
    held: dict[str, list[tuple[str, DeviceClaim]]] = {}
    for component in snapshot.components:
        for claim in component.devices:
            if claim.device is not None:
                held.setdefault(claim.device, []).append((component.id, claim))
    return held


def why_rows(snapshot: Snapshot) -> list[Row]:
    """Every device, and how it fared with every need of every component."""
    devices = {device.id: device for device in snapshot.devices}
    return [
        {**row, "asked": list(_asked(devices[row["device"]], snapshot))}
        for row in rows_of(snapshot)
    ]


def _asked(device: DeviceRecord, snapshot: Snapshot) -> Iterator[Row]:
    for component in snapshot.components:
        for claim in component.devices:
            trials = tried(device, claim.match)
            yield {
                "component": component.id,
                "need": claim.name,
                "outcome": _outcome(device, claim, trials),
                "nodes": [_trial_row(trial) for trial in trials],
            }


def _outcome(device: DeviceRecord, claim: DeviceClaim, trials: Sequence[Trial]) -> str:
    if claim.device == device.id:
        return "has it"
    if not any(trial.serves for trial in trials):
        return "does not match"
    if claim.device is not None:
        return f"has {claim.device}"
    return "another component has it"


def _trial_row(trial: Trial) -> Row:
    return {
        "node": str(trial.node.node),
        "serves": trial.serves,
        "kept_back": trial.kept_back,
        "rules": [to_plain(verdict) for verdict in trial.verdicts],
    }

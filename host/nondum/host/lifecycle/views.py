"""What people's tools are shown of payloads, components and the journal: plain data."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from nondum.host.catalogue.records import (
    ComponentRecord,
    JournalEntry,
    PayloadRecord,
    Snapshot,
    object_name,
)

Row = dict[str, Any]


def payloads(snapshot: Snapshot) -> list[Row]:
    """Every payload that is here: how far it has come, when, and what is wrong with it."""
    return [_payload(payload) for payload in snapshot.payloads]


def drives(snapshot: Snapshot) -> list[Row]:
    """Every drive that is in."""
    return [
        {
            "drive": drive.id,
            "kind": drive.kind,
            "state": drive.state.value,
            "problems": [str(problem) for problem in drive.problems],
        }
        for drive in snapshot.drives
    ]


def components(snapshot: Snapshot) -> list[Row]:
    """Every component, by rank."""
    return [_component(snapshot.host, component) for component in snapshot.components]


def devices(snapshot: Snapshot) -> list[Row]:
    """Every device that is plugged in, and who has it."""
    holders = {
        claim.device: (component.id, claim)
        for component in snapshot.components
        for claim in component.devices
    }
    rows = []
    for device in snapshot.devices:
        component, claim = holders.get(device.id, ("", None))
        rows.append(
            {
                "device": device.id,
                "node": str(device.node),
                "component": component,
                "need": claim.name if claim else "",
                "contested_by": list(claim.contested_by) if claim else [],
                "properties": dict(device.properties),
            }
        )
    return rows


def problems(snapshot: Snapshot) -> list[Row]:
    """Everything that is wrong: code, message and the rest, with what it is about."""
    told = [
        *((drive.id, drive.problems) for drive in snapshot.drives),
        *((payload.payload_id, payload.problems) for payload in snapshot.payloads),
        *((component.id, component.problems) for component in snapshot.components),
    ]
    return [
        {"subject": subject, **problem.to_dict()} for subject, found in told for problem in found
    ]


def journal(entries: Iterable[JournalEntry]) -> list[Row]:
    """Entries of the journal, in the order given."""
    return [
        {
            "id": entry.id,
            "when": entry.at.wall_s,
            "monotonic_s": entry.at.monotonic_s,
            "subject": entry.subject,
            "event": entry.event,
            "step": entry.step,
            "problems": [problem.to_dict() for problem in entry.problems],
            "detail": [str(problem) for problem in entry.problems] or dict(entry.detail),
        }
        for entry in entries
    ]


def _payload(payload: PayloadRecord) -> Row:
    seen = payload.phases.get("seen")
    return {
        "payload": payload.payload_id,
        "key": payload.key,
        "version": payload.version,
        "release": payload.release,
        "state": payload.step.value,
        "drive": ", ".join(payload.drives),
        "components": list(payload.components),
        "problems": [str(problem) for problem in payload.problems],
        "phases": {
            name: {
                "when": moment.wall_s,
                "after_s": round(moment.monotonic_s - seen.monotonic_s, 3) if seen else 0.0,
            }
            for name, moment in payload.phases.items()
        },
    }


def _component(host: str, component: ComponentRecord) -> Row:
    missing = [c.name for c in component.devices if c.device is None and not c.optional]
    waiting = [f"waits for its device {name!r}" for name in missing]
    return {
        "component": component.id,
        "state": component.state.value,
        "ready": component.is_ready,
        "plugin": component.distribution,
        "version": component.version,
        "payload": component.payload_id,
        "units": [object_name(host, component.id, u.name) for u in component.description.units],
        "devices": {claim.name: claim.device for claim in component.devices},
        "problem": "; ".join([*map(str, component.problems), *waiting]),
    }

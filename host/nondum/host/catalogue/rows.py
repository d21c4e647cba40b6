"""Records as rows of `schema.sql`, and rows as records."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterable
from dataclasses import fields
from pathlib import Path
from typing import Any

from nondum.host.core.records.component import ComponentRecord, ComponentState
from nondum.host.core.records.device import (
    DeviceClaim,
    DeviceInterface,
    DeviceNode,
    DeviceRecord,
    KnownDevice,
)
from nondum.host.core.records.drive import DriveRecord, DriveState
from nondum.host.core.records.goal import GoalRecord
from nondum.host.core.records.journal import JournalEntry
from nondum.host.core.records.moment import Moment
from nondum.host.core.records.mount import MountPose
from nondum.host.core.records.payload import FormerPayload, PayloadRecord
from nondum.host.core.records.step import Step
from nondum.host.core.state import Highwater
from nondum.planning.merge.given_names import GivenNames
from nondum.sdk.codec.values import to_plain
from nondum.sdk.description import PluginDescription
from nondum.sdk.errors import NondumError, Problem

Row = dict[str, Any]

_DEVICE = (
    *("id", "bus", "port", "parent", "driver", "vendor", "product", "serial", "name"),
    *("first_s", "since_s"),
)
"""Columns of `devices`, which are fields of its record."""


def as_json(value: Any) -> str:
    """Any value of a record as JSON text."""
    return json.dumps(to_plain(value), ensure_ascii=False, separators=(",", ":"))


def storable(row: Row) -> Row:
    """A row that SQLite can have, whatever is in it: a half letter, which UTF-8 has not, is told by
    its number."""
    return {
        name: value.encode("utf-8", "backslashreplace").decode()
        if isinstance(value, str) and not value.isascii()
        else value
        for name, value in row.items()
    }


def _problems(text: str) -> tuple[Problem, ...]:
    return tuple(Problem(**problem) for problem in json.loads(text))


def _pair(moment: Moment) -> list[float]:
    return [moment.monotonic_s, moment.wall_s]


def drive_row(drive: DriveRecord) -> Row:
    """A row of `drives`."""
    return {
        "id": drive.id,
        "kind": drive.kind,
        "root": str(drive.root),
        "node": str(drive.node) if drive.node else None,
        "filesystem": drive.filesystem,
        "state": drive.state.value,
        "since": as_json(_pair(drive.since)),
        "problems": as_json(drive.problems),
        "mark": drive.mark,
    }


def drive(row: sqlite3.Row) -> DriveRecord:
    """A drive of its row."""
    return DriveRecord(
        id=row["id"],
        kind=row["kind"],
        root=Path(row["root"]),
        node=Path(row["node"]) if row["node"] else None,
        filesystem=row["filesystem"],
        state=DriveState(row["state"]),
        since=Moment(*json.loads(row["since"])),
        problems=_problems(row["problems"]),
        mark=row["mark"],
    )


def payload_row(payload: PayloadRecord) -> Row:
    """A row of `payloads`."""
    return {
        "key": payload.key,
        "digest": payload.digest,
        "payload_id": payload.payload_id,
        "version": payload.version,
        "release": payload.release,
        "fleet": payload.fleet,
        "step": payload.step.value,
        "phases": as_json({name: _pair(moment) for name, moment in payload.phases.items()}),
        "components": as_json(payload.components),
        "renamed": as_json(payload.renamed),
        "problems": as_json(payload.problems),
        "was": payload.was,
    }


def payload(row: sqlite3.Row, sources: Iterable[sqlite3.Row]) -> PayloadRecord:
    """A payload of its row and those of its sources, in their order."""
    phases = json.loads(row["phases"])
    return PayloadRecord(
        key=row["key"],
        digest=row["digest"],
        payload_id=row["payload_id"],
        version=row["version"],
        release=row["release"],
        fleet=row["fleet"],
        step=Step(row["step"]),
        sources={source["drive"]: Path(source["folder"]) for source in sources},
        phases={name: Moment(*pair) for name, pair in phases.items()},
        components=tuple(json.loads(row["components"])),
        renamed=json.loads(row["renamed"]),
        problems=_problems(row["problems"]),
        was=row["was"],
    )


def source_rows(payload: PayloadRecord) -> list[Row]:
    """Rows of `sources`."""
    return [
        {"payload": payload.key, "position": i, "drive": drive, "folder": str(folder)}
        for i, (drive, folder) in enumerate(payload.sources.items())
    ]


def component_row(component: ComponentRecord) -> Row:
    """A row of `components`."""
    return {
        "id": component.id,
        "payload": component.payload,
        "payload_id": component.payload_id,
        "distribution": component.distribution,
        "entry_point": component.entry_point,
        "version": component.version,
        "state": component.state.value,
        "description": as_json(component.description),
        "venv": str(component.venv),
        "site_packages": str(component.site_packages),
        "scratch": str(component.scratch),
        "rank": component.rank,
        "permissions": as_json(component.permissions),
        "settings": as_json(component.settings),
        "problems": as_json(component.problems),
    }


def component(row: sqlite3.Row, claims: Iterable[sqlite3.Row]) -> ComponentRecord:
    """A component of its row and those of its claims, in their order."""
    return ComponentRecord(
        id=row["id"],
        payload=row["payload"],
        payload_id=row["payload_id"],
        distribution=row["distribution"],
        entry_point=row["entry_point"],
        version=row["version"],
        state=ComponentState(row["state"]),
        description=PluginDescription.parse(json.loads(row["description"]), where=row["id"]),
        venv=Path(row["venv"]),
        site_packages=Path(row["site_packages"]),
        scratch=Path(row["scratch"]),
        rank=row["rank"],
        permissions=tuple(json.loads(row["permissions"])),
        settings=json.loads(row["settings"]),
        devices=tuple(_claim(claim) for claim in claims),
        problems=_problems(row["problems"]),
    )


def claim_rows(component: ComponentRecord) -> list[Row]:
    """Rows of `claims`."""
    return [
        {
            "component": component.id,
            "position": i,
            "name": claim.name,
            "match": as_json(claim.match),
            "optional": int(claim.optional),
            "device": claim.device,
            "contested_by": as_json(claim.contested_by),
            "nodes": as_json(claim.nodes),
        }
        for i, claim in enumerate(component.devices)
    ]


def _claim(row: sqlite3.Row) -> DeviceClaim:
    return DeviceClaim(
        name=row["name"],
        match=json.loads(row["match"]),
        optional=bool(row["optional"]),
        device=row["device"],
        contested_by=tuple(json.loads(row["contested_by"])),
        nodes=tuple(map(Path, json.loads(row["nodes"]))),
    )


def device_row(device: DeviceRecord) -> Row:
    """A row of `devices`."""
    return {name: getattr(device, name) for name in _DEVICE}


def interface_rows(device: DeviceRecord) -> list[Row]:
    """Rows of `device_interfaces`."""
    return [
        {"device": device.id, "position": i, **to_plain(interface)}
        for i, interface in enumerate(device.interfaces)
    ]


def node_rows(device: DeviceRecord) -> list[Row]:
    """Rows of `device_nodes`."""
    return [
        {
            "device": device.id,
            "position": i,
            "node": str(node.node),
            "interface": node.interface,
            "properties": as_json(node.properties),
        }
        for i, node in enumerate(device.nodes)
    ]


def device(
    row: sqlite3.Row, interfaces: Iterable[sqlite3.Row], nodes: Iterable[sqlite3.Row]
) -> DeviceRecord:
    """A device of its row and those of its parts, in their order."""
    return DeviceRecord(
        nodes=tuple(
            DeviceNode(Path(one["node"]), json.loads(one["properties"]), one["interface"])
            for one in nodes
        ),
        interfaces=tuple(
            DeviceInterface(one["number"], one["kind"], one["driver"]) for one in interfaces
        ),
        **{name: row[name] for name in _DEVICE},
    )


_KNOWN_DEVICE = tuple(field.name for field in fields(KnownDevice))


def known_device_row(known: KnownDevice) -> Row:
    """A row of `known_devices`."""
    return {name: getattr(known, name) for name in _KNOWN_DEVICE}


def known_device(row: sqlite3.Row) -> KnownDevice:
    """A known device of its row."""
    return KnownDevice(**{name: row[name] for name in _KNOWN_DEVICE})


def mount_row(mount: MountPose) -> Row:
    """A row of `mounts`."""
    return {"unit": mount.unit, "pose": as_json(mount.xyz + mount.rpy), "origin": mount.origin}


def mount(row: sqlite3.Row) -> MountPose:
    """A mount pose of its row."""
    x, y, z, roll, pitch, yaw = json.loads(row["pose"])
    return MountPose(row["unit"], (x, y, z), (roll, pitch, yaw), row["origin"])


def goal_row(goal: GoalRecord) -> Row:
    """A row of `goals`."""
    return {
        "id": goal.id,
        "text": goal.text,
        "pddl": goal.pddl,
        "kind": goal.kind,
        "priority": goal.priority,
    }


def goal(row: sqlite3.Row) -> GoalRecord:
    """A goal of its row."""
    return GoalRecord(row["id"], row["text"], row["pddl"], row["kind"], row["priority"])


def highwater_row(newest: Highwater) -> Row:
    """A row of `highwater`, but for whose it is."""
    return {"release": newest.release, "digest": newest.digest, "owner": newest.owner}


def highwater(row: sqlite3.Row) -> Highwater:
    """The newest release of its row."""
    return Highwater(row["release"], row["digest"], row["owner"])


def names_row(payload_id: str, names: GivenNames) -> Row:
    """A row of `names`."""
    return {
        "payload_id": payload_id,
        "components": as_json(names.components),
        "plugins": as_json(names.plugins),
    }


def names(row: sqlite3.Row) -> GivenNames:
    """What is called how, of its row."""
    return GivenNames(json.loads(row["components"]), json.loads(row["plugins"]))


def former_row(former: FormerPayload) -> Row:
    """A row of `former`."""
    return {
        "payload_id": former.key,
        "version": former.version,
        "components": as_json(former.components),
        "left_wall_s": former.left_wall_s,
    }


def former(row: sqlite3.Row) -> FormerPayload | None:
    """What is remembered of a payload; None if this nondum cannot read it.

    Rows may be older than the nondum that reads them by many versions, and no daemon should fail to
    start for want of a memory.
    """
    try:
        said = dict(json.loads(row["components"]))
        components = {id: PluginDescription.parse(one, where=id) for id, one in said.items()}
    except (NondumError, TypeError, ValueError):
        return None
    size = len(row["components"])
    payload_id, _, host = row["payload_id"].partition("@")
    return FormerPayload(payload_id, row["version"], components, row["left_wall_s"], size, host)


def entry_row(entry: JournalEntry) -> Row:
    """A row of `journal`, but for its id, which the database gives."""
    return {
        "monotonic_s": entry.at.monotonic_s,
        "wall_s": entry.at.wall_s,
        "boot": entry.boot,
        "event": entry.event,
        "subject": entry.subject,
        "step": entry.step,
        "problems": as_json(entry.problems),
        "detail": as_json(entry.detail),
    }


def entry(row: sqlite3.Row) -> JournalEntry:
    """A journal entry of its row."""
    return JournalEntry(
        id=row["id"],
        at=Moment(row["monotonic_s"], row["wall_s"]),
        boot=row["boot"],
        event=row["event"],
        subject=row["subject"],
        step=row["step"],
        problems=_problems(row["problems"]),
        detail=json.loads(row["detail"]),
    )

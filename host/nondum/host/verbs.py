"""What can be asked of a running host: each verb of the control socket, in plain data."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import AsyncIterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from nondum.host.catalogue.catalogue import Catalogue
from nondum.host.catalogue.records import JournalEntry, MountPose, PayloadRecord, Snapshot
from nondum.host.control.server import Follow, Verb
from nondum.host.events import MountSet
from nondum.host.lifecycle import installed
from nondum.host.lifecycle.bus import Bus
from nondum.host.mind.frames import implausible
from nondum.host.mind.mind import Mind
from nondum.host.workers.workers import Workers
from nondum.sdk.errors import ConfigRefused, GoalRefused, InstallFailed, Problem
from nondum.wheelhouse.store import Store, StoredWheel

Arguments = Mapping[str, Any]
Row = dict[str, Any]

TAP_TIMEOUT_S = 5.0
TOLD_IN_STATUS = 20
TOLD_IN_WATCH = 50


@dataclass(frozen=True, slots=True)
class Verbs:
    """Answers for one host. Looks at its parts, and passes on what people want done."""

    catalogue: Catalogue
    mind: Mind
    workers: Workers
    store: Store
    bus: Bus
    warnings: tuple[str, ...]
    """What every status says of this host."""

    def answering(self) -> dict[str, Verb]:
        """Verbs that answer once, by name."""
        return {
            "behaviours": self.behaviours,
            "components": self.components,
            "facts": self.facts,
            "goal": self.goal,
            "goals": self.goals,
            "halt": self.halt,
            "install": self.install,
            "journal": self.journal,
            "logs": self.logs,
            "mount": self.mount,
            "plan": self.plan,
            "status": self.status,
            "store": self.listed_store,
            "streams": self.streams,
            "tap": self.tap,
            "tree": self.tree,
            "uninstall": self.uninstall,
            "units": self.units,
            "why": self.why,
        }

    def following(self) -> dict[str, Follow]:
        """Verbs that go on answering, by name."""
        return {
            "follow_goal": self.follow_goal,
            "follow_tree": self.follow_tree,
            "watch": self.watch,
        }

    # Looking

    async def status(self, arguments: Arguments) -> Row:
        """The host, its payloads and its goals at a glance."""
        snapshot = self.catalogue.snapshot()
        return {
            "host": snapshot.host,
            "revision": snapshot.revision,
            "state": _state(snapshot),
            "warnings": list(self.warnings),
            "payloads": [_payload(payload) for payload in snapshot.payloads],
            "drives": [
                {"drive": d.id, "kind": d.kind, "problems": [str(p) for p in d.problems]}
                for d in snapshot.drives
            ],
            "goals": self.mind.views.goals()["given"],
            "told": [row["text"] for row in self.mind.views.told()[-TOLD_IN_STATUS:]],
        }

    async def components(self, arguments: Arguments) -> list[Row]:
        """What the robot is made of."""
        pids = self.workers.pids()
        return [
            {
                "component": component.id,
                "state": component.state.value if component.is_ready else _unready(component),
                "plugin": component.distribution,
                "version": component.version,
                "payload": component.payload_id,
                "units": [unit.name for unit in component.description.units],
                "behaviours": [b.name for b in component.description.behaviours],
                "devices": {claim.name: claim.device for claim in component.devices},
                "pid": pids.get(component.id),
                "problem": str(component.problems[0]) if component.problems else "",
            }
            for component in self.catalogue.snapshot().components
        ]

    async def behaviours(self, arguments: Arguments) -> list[Row]:
        """What can be done."""
        return self.mind.views.behaviours()

    async def units(self, arguments: Arguments) -> list[Row]:
        """What there is to act with."""
        return self.mind.views.units()

    async def streams(self, arguments: Arguments) -> list[Row]:
        """Who sends what to whom."""
        return [
            {
                "stream": stream.stream,
                "type": stream.type,
                "component": stream.component,
                "flowing": stream.is_flowing,
                "consumers": list(stream.readers),
            }
            for stream in self.workers.streams.listing()
        ]

    async def facts(self, arguments: Arguments) -> list[Row]:
        """What is believed, and why."""
        return self.mind.views.facts(why=arguments.get("why"))

    async def goals(self, arguments: Arguments) -> Row:
        """What can be asked for, and what was."""
        return self.mind.views.goals()

    async def plan(self, arguments: Arguments) -> Row:
        """The plan that is carried out."""
        return self.mind.views.plan()

    async def tree(self, arguments: Arguments) -> Row:
        """The behaviour tree as last ticked."""
        return self.mind.views.tree()

    async def why(self, arguments: Arguments) -> Row:
        """Why the robot does what it does, or cannot; refused payloads and drives included."""
        view = self.mind.views.why()
        snapshot = self.catalogue.snapshot()
        refused = [str(p) for payload in snapshot.payloads for p in payload.problems]
        failed = [str(p) for component in snapshot.components for p in component.problems]
        unread = [str(p) for drive in snapshot.drives for p in drive.problems]
        return {**view, "problems": [*view["problems"], *refused, *failed, *unread]}

    async def journal(self, arguments: Arguments) -> list[Row]:
        """What happened, oldest first."""
        entries = await self.catalogue.journal(
            subject=arguments.get("subject"), limit=int(arguments.get("limit") or 200)
        )
        return [_entry(entry) for entry in entries]

    async def logs(self, arguments: Arguments) -> list[Row]:
        """What components have written, by time."""
        logs, named = self.workers.logs, arguments.get("component")
        rows = [
            {"component": name, "when": line.at.wall_s, "level": line.level, "message": line.text}
            for name in ([str(named)] if named else logs.components())
            for line in logs.of(name)
        ]
        return sorted(rows, key=lambda row: row["when"])

    async def listed_store(self, arguments: Arguments) -> list[Row]:
        """The wheels that are kept, and who uses them."""
        listing = await asyncio.to_thread(self.store.listing)
        return [_stored(wheel) for wheel in listing]

    # Acting

    async def goal(self, arguments: Arguments) -> Row:
        """Give a goal. Raises `GoalRefused`."""
        given = self.mind.give(
            words=arguments.get("words"),
            pddl=arguments.get("pddl"),
            kind=arguments.get("kind"),
            priority=int(arguments.get("priority") or 0),
        )
        return given.to_dict()

    async def halt(self, arguments: Arguments) -> Row:
        """Halt a goal, or everything."""
        now = bool(arguments.get("now"))
        halted = self.mind.halt(id=arguments.get("id"), now=now)
        if now:
            self.workers.halt_all()
        return {"halted": list(halted)}

    async def install(self, arguments: Arguments) -> Row:
        """Install a payload folder for good. Raises `PayloadRefused`."""
        folder = Path(str(arguments.get("folder")))
        return _payload(await installed.install(folder, self.catalogue, self.bus))

    async def uninstall(self, arguments: Arguments) -> Row:
        """Remove an installed payload. Raises `PayloadRefused` (NOT_INSTALLED)."""
        payload_id = str(arguments.get("payload"))
        await installed.uninstall(payload_id, self.catalogue, self.bus)
        return {"payload": payload_id}

    async def mount(self, arguments: Arguments) -> Row:
        """Tell where a unit is mounted. Raises `ConfigRefused` (UNIT_UNKNOWN)."""
        unit = str(arguments.get("unit"))
        known = [row["unit"] for row in self.mind.views.units()]
        if unit not in known:
            fix = f"units here: {', '.join(known) or 'none'}"
            text = f"there is no unit {unit!r}"
            raise ConfigRefused(Problem("UNIT_UNKNOWN", text, where="mount", fix=fix))
        pose = MountPose(unit, _triple(arguments, "xyz"), _triple(arguments, "rpy"), "person")
        self.bus.emit(MountSet(pose.unit, pose.xyz, pose.rpy))
        row = {"unit": unit, "xyz": list(pose.xyz), "rpy": list(pose.rpy)}
        return {**row, "warnings": list(implausible(pose))}

    async def tap(self, arguments: Arguments) -> Row:
        """Connect a stream to the socket that the client listens on. Raises `InstallFailed`."""
        name = str(arguments.get("stream"))
        found = {s.stream: s for s in self.workers.streams.listing()}.get(name)
        if found is None:
            text = f"there is no stream {name!r}"
            fix = "see `nondum streams`"
            raise ConfigRefused(Problem("STREAM_UNKNOWN", text, where="tap", fix=fix))
        with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as connection:
            connection.settimeout(TAP_TIMEOUT_S)
            try:
                await asyncio.to_thread(connection.connect, str(arguments.get("address")))
            except OSError as error:
                problem = Problem("TAP_UNREACHABLE", str(error), where="tap")
                raise InstallFailed(problem) from error
            await self.workers.streams.tap(name, connection)
        return {"stream": name, "type": found.type}

    # Following

    async def follow_goal(self, arguments: Arguments) -> AsyncIterator[Row]:
        """A goal, now and whenever the host looks different. Raises `GoalRefused`."""
        id, version = str(arguments.get("id")), -1
        while True:
            version = await self.mind.changed(version)
            given = next((row for row in self.mind.views.goals()["given"] if row["id"] == id), None)
            if given is None:
                raise GoalRefused(Problem("GOAL_UNKNOWN", f"there is no goal {id!r}"))
            yield given

    async def follow_tree(self, arguments: Arguments) -> AsyncIterator[Row]:
        """The tree, now and whenever it looks different."""
        version = -1
        while True:
            version = await self.mind.changed(version)
            yield self.mind.views.tree()

    async def watch(self, arguments: Arguments) -> AsyncIterator[Row]:
        """Everything at a glance, now and whenever the host looks different."""
        version = -1
        while True:
            version = await self.mind.changed(version)
            yield {
                **await self.status(arguments),
                "components": await self.components(arguments),
                "streams": await self.streams(arguments),
                "plan": self.mind.views.plan(),
                "tree": self.mind.views.tree(),
                "told": self.mind.views.told(self.mind.people.last_number - TOLD_IN_WATCH),
            }


def _state(snapshot: Snapshot) -> str:
    busy = {"GONE", "ACTIVE", "REFUSED", "QUARANTINED"}
    if any(payload.step.name not in busy for payload in snapshot.payloads):
        return "working"
    if any(payload.problems for payload in snapshot.payloads):
        return "ready, with refusals"
    return "ready"


def _unready(component: Any) -> str:
    missing = [c.name for c in component.devices if c.device is None and not c.optional]
    if component.state.value == "ready" and missing:
        return f"waits for {', '.join(missing)}"
    return str(component.state.value)


def _payload(payload: PayloadRecord) -> Row:
    return {
        "payload": payload.payload_id,
        "version": payload.version,
        "release": payload.release,
        "state": payload.step.value,
        "drive": ", ".join(payload.drives),
        "components": list(payload.components),
        "problems": [str(problem) for problem in payload.problems],
        "codes": [problem.code for problem in payload.problems],
        "phases": {phase: moment.monotonic_s for phase, moment in payload.phases.items()},
    }


def _entry(entry: JournalEntry) -> Row:
    return {
        "id": entry.id,
        "when": entry.at.wall_s,
        "monotonic": entry.at.monotonic_s,
        "boot": entry.boot,
        "event": entry.event,
        "subject": entry.subject,
        "step": entry.step,
        "problems": [problem.to_dict() for problem in entry.problems],
        "detail": "; ".join(str(problem) for problem in entry.problems)
        or ", ".join(f"{key}={value}" for key, value in entry.detail.items())[:200],
    }


def _stored(wheel: StoredWheel) -> Row:
    return {
        "wheel": wheel.filename,
        "bytes": wheel.size,
        "files": len(wheel.files),
        "sha256": wheel.sha256[:16],
    }


def _triple(arguments: Arguments, key: str) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in arguments[key])
    return x, y, z

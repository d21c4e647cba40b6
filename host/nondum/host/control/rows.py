"""What people's tools are shown of the catalogue and the streams: plain data, one row a thing."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping

from nondum.host.control.news import Progress
from nondum.host.core.records.component import ComponentRecord, ComponentState
from nondum.host.core.records.data import DataRecord
from nondum.host.core.records.drive import DriveRecord
from nondum.host.core.records.journal import JournalEntry
from nondum.host.core.records.payload import PayloadRecord
from nondum.host.core.records.peer import PeerComponent
from nondum.host.core.records.safety import Safety
from nondum.host.core.records.snapshot import Snapshot
from nondum.host.core.records.step import Step
from nondum.host.core.row import Row
from nondum.host.core.status import is_at_rest, waits
from nondum.host.trust.vouched import UNVOUCHED, Vouched
from nondum.host.workers.optional_inputs import Choice, Source
from nondum.host.workers.streams import StreamStatus
from nondum.sdk.errors import Problem

_OVER = frozenset({"reached", "halted"})
"""Of the states of a goal."""


def host_state(snapshot: Snapshot, places: Mapping[str, str]) -> str:
    """The host in a word or three: `working`, `ready`, or `ready, with problems`.

    In safe mode, that comes first.

    Payloads that have a place on a peer are none.
    """
    safe = "" if snapshot.safety is Safety.OFF else "safe mode, "
    if not all(map(is_at_rest, snapshot.payloads)):
        return f"{safe}working"
    return f"{safe}ready{', with problems' if any(problems_of(snapshot, places)) else ''}"


def own_goal_row(row: Row, host: str) -> Row:
    """A goal of this host; rows of goals that were given to peers say that they are elsewhere."""
    return {**row, "host": host, "is_elsewhere": False}


def goals_away(rows: Iterable[Row]) -> Iterator[str]:
    """Those of the goals given to peers that are not over, in sentences."""
    for row in rows:
        if row["state"] not in _OVER:
            told = f"goal {row['id']} of {row['host']}, {row['text']!r}, is {row['state']}"
            yield ": ".join(filter(None, (told, row["reason"])))


def gone_back(snapshot: Snapshot) -> Iterator[PayloadRecord]:
    """The active releases that people went back to."""
    return (
        payload
        for payload in snapshot.payloads
        if payload.digest in snapshot.rollbacks and payload.step is Step.ACTIVE
    )


def problems_of(snapshot: Snapshot, places: Collection[str] = ()) -> Iterator[Problem]:
    """All that is wrong with payloads, components and drives; not what keeps those from this host
    that have `places` on others."""
    for payload in snapshot.payloads:
        if payload.key not in places:
            yield from payload.problems
    for component in snapshot.components:
        yield from component.problems
        yield from waits(component)
    for drive in snapshot.drives:
        yield from drive.problems


def payload_row(
    payload: PayloadRecord,
    progress: Progress | None,
    place: str = "",
    rollbacks: Collection[str] = (),
    vouched: Vouched = UNVOUCHED,
    components: Iterable[ComponentRecord] = (),
) -> Row:
    """A payload: how far it has come, where it is, what is wrong with it, and the peer that it runs
    on, if it does. `rollbacks` are the digests of those that people went back to, `components` all
    that are here: the row names each device and all data that the payload's own wait for."""
    return {
        "payload": payload.payload_id,
        "key": payload.key,
        "version": payload.version,
        "release": payload.release,
        "was": payload.was or None,
        "gone_back": payload.digest in rollbacks,
        "state": payload.step.value,
        "progress": progress.to_dict() if progress else None,
        "waits_for": [name for c in components if c.payload == payload.key for name in c.missing],
        "place": place,
        "signers": list(vouched.signers),
        "built": vouched.built,
        "age_s": vouched.age_s,
        "drive": ", ".join(payload.drives),
        "components": list(payload.components),
        "problems": [str(problem) for problem in payload.problems],
        "codes": [problem.code for problem in payload.problems],
        "phases": {phase: moment.monotonic_s for phase, moment in payload.phases.items()},
    }


def drive_row(drive: DriveRecord, ahead: int = 0) -> Row:
    """A drive that is in; `queued` as long as others are looked through `ahead` of it."""
    return {
        "drive": drive.id,
        "kind": drive.kind,
        "state": "queued" if ahead else drive.state.value,
        "ahead": ahead,
        "problems": [str(problem) for problem in drive.problems],
    }


def peers_device_row(device: str, component: str) -> Row:
    """A device of a peer, in the same columns: of it, only who has it is told."""
    row = {"device": device, "node": "", "component": component, "need": "", "name": ""}
    return {**row, "contested_by": [], "properties": {}, "nodes": [], "left_alone": ""}


def component_row(
    component: ComponentRecord,
    host: str,
    pid: int | None,
    payload: PayloadRecord | None,
    vouched: Vouched = UNVOUCHED,
) -> Row:
    """A component: how it is, and what it brings."""
    described = component.description
    return {
        "component": component.id,
        "host": host,
        "state": _state(component),
        "ready": component.is_ready,
        "plugin": component.distribution,
        "version": component.version,
        "payload": component.payload_id,
        "release": payload.release if payload else None,
        "was": payload.was or None if payload else None,
        "built": vouched.built,
        "age_s": vouched.age_s,
        "units": [unit.name for unit in described.units],
        "behaviours": [behaviour.name for behaviour in described.behaviours],
        "devices": {claim.name: claim.device for claim in component.devices},
        "data": {claim.need.name: claim.data for claim in component.data},
        "pid": pid,
        "granted": {},
        "problem": "; ".join(str(problem) for problem in component.problems),
    }


def data_row(data: DataRecord, components: Iterable[ComponentRecord]) -> Row:
    """Data that are here, and which of the components are shown them."""
    return {
        "data": data.name,
        "kind": data.kind,
        "version": data.version,
        "bytes": data.size,
        "files": list(data.files),
        "payload": data.payload_id,
        "shown_to": [
            component.id
            for component in components
            if any(claim.data == data.id for claim in component.data)
        ],
    }


def offered_row(component: PeerComponent, host: str) -> Row:
    """A component of a peer, in the same columns; what is withheld is its problem."""
    described = component.description
    withheld = ", ".join(component.withheld)
    return {
        "component": component.id,
        "host": host,
        "state": "ready" if component.is_ready else "not ready",
        "ready": component.is_ready,
        "plugin": described.name,
        "version": component.version,
        "payload": component.payload_id,
        "release": None,
        "was": None,
        "built": "",
        "age_s": None,
        "units": [unit.name for unit in described.units],
        "behaviours": list(component.abilities),
        "devices": {},
        "data": {},
        "pid": None,
        "granted": {},
        "problem": f"its host does not offer {withheld}" if withheld else "",
    }


def stream_row(stream: StreamStatus, rate_hz: float | None = None) -> Row:
    """A stream: its producer, its rate (where it is known), and its readers."""
    return {
        "stream": stream.stream,
        "type": stream.type,
        "component": stream.component,
        "flowing": stream.is_flowing,
        "rate_hz": rate_hz if stream.is_flowing else None,
        "consumers": list(stream.readers),
    }


def input_row(choice: Choice, sources: Iterable[Source]) -> Row:
    """An optional input: what it asks for, what feeds it and why, and what else could."""
    socket = choice.socket
    return {
        "input": socket.name,
        "type": socket.type,
        "of": socket.of or None,
        "stream": choice.source.stream if choice.source else None,
        "why": _why(choice),
        "connected": choice.chosen or None,
        "ambiguous": choice.is_ambiguous,
        "could_be": [source.stream for source in sources if socket.takes(source)],
    }


def _why(choice: Choice) -> str:
    socket = choice.socket
    wanted = f"a {socket.type} of a {socket.of}" if socket.of else f"any {socket.type}"
    if choice.chosen:
        waits = "" if choice.source else f"; waits for {choice.chosen}"
        return f"connected by a person{waits}"
    if choice.source is None:
        return f"waits for {wanted}"
    if choice.others:
        return f"{wanted}: the first by name of {1 + len(choice.others)}"
    return wanted


def journal_row(entry: JournalEntry) -> Row:
    """An entry of the journal."""
    return {
        "id": entry.id,
        "when": entry.at.wall_s,
        "monotonic": entry.at.monotonic_s,
        "boot": entry.boot,
        "event": entry.event,
        "subject": entry.subject,
        "step": entry.step,
        "problems": [problem.to_dict() for problem in entry.problems],
        "detail": dict(entry.detail),
    }


def _state(component: ComponentRecord) -> str:
    if component.state is ComponentState.READY and component.missing:
        return f"waits for {', '.join(component.missing)}"
    return component.state.value

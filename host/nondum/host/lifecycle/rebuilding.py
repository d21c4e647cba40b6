"""What is installed for good is told beside its files, so that it outlives the catalogue.

The note names the drive that stands for it; release, version and components are in its own files,
which are hashed again before they are believed.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from nondum.host.core import payload_key
from nondum.host.core.effects import NoteInstalled
from nondum.host.core.records.drive import INSTALLED, DriveRecord, DriveState
from nondum.host.core.records.moment import Moment
from nondum.host.core.records.payload import PayloadRecord
from nondum.host.core.records.step import Step
from nondum.host.core.state import Highwater, HostState
from nondum.host.core.transitions import KEEPS_FOLDER
from nondum.host.jobs.table import Arguments, Report
from nondum.host.lifecycle import component_names, crash_attribution
from nondum.host.lifecycle.turn import Turn
from nondum.sdk.errors import NondumError
from nondum.wheelhouse.format import contents
from nondum.wheelhouse.payload import payload
from nondum.wheelhouse.store import disk


def settle(turn: Turn, before: HostState) -> None:
    """Have the notes written of what is now installed for good, and those undone of what is not."""
    for key, record in turn.state.payloads.items():
        now, then = _noted(turn.state, record), _noted(before, before.payloads.get(key))
        if now != then and record.step in KEEPS_FOLDER:
            turn.effects.append(NoteInstalled(key, *(now or ("", None))))


def noting_all(state: HostState) -> Iterator[NoteInstalled]:
    """What a daemon that starts writes down again: it costs little, and a note may be lost."""
    for key, record in state.payloads.items():
        if (found := _noted(state, record)) is not None:
            yield NoteInstalled(key, *found)


def _noted(state: HostState, record: PayloadRecord | None) -> tuple[str, Path] | None:
    """Drive and folder of a payload that is installed for good and has its files here."""
    if (
        record is None
        or record.step not in KEEPS_FOLDER
        or not crash_attribution.is_initial(state, record)
    ):
        return None
    drives = (state.drives[name] for name in record.sources if name in state.drives)
    return next((drive.id, drive.root) for drive in drives if drive.kind == INSTALLED)


def write_note(note: Path, drive: str, folder: Path | None) -> None:
    """Write a note, or undo it."""
    if folder is None:
        note.unlink(missing_ok=True)
        return
    data = json.dumps({"drive": drive, "folder": str(folder)}).encode()
    if not note.exists() or note.read_bytes() != data:
        disk.make_folder(note.parent)
        disk.write(note, data)


def found(arguments: Arguments, report: Report) -> list[dict[str, Any]]:
    """In a child: each payload that a note tells of, if its files are whole."""
    notes, payloads = Path(arguments["notes"]), Path(arguments["payloads"])
    said = []
    for note in sorted(notes.glob("*.json")):
        try:
            said.append(_told(json.loads(note.read_bytes()), payloads / note.stem))
        except (NondumError, OSError, ValueError, LookupError):
            continue  # it is not brought back: the sweep takes its files away
    return said


def _told(note: Mapping[str, str], folder: Path) -> dict[str, Any]:
    data = (folder / contents.NAME).read_bytes()
    digest = hashlib.sha256(data).hexdigest()
    if not payload_key.is_key_of(folder.name, digest):
        raise ValueError("it is not the payload that it was")
    listed = contents.parse(data, contents.NAME)
    for entry in (entry for entry in listed.entries if payload.is_metadata(entry.path)):
        if hashlib.sha256((folder / entry.path).read_bytes()).hexdigest() != entry.sha256:
            raise ValueError(f"{entry.path} is not what it was")
    staged = payload.load(folder, listed)
    return {
        "key": folder.name,
        "digest": digest,
        "payload_id": listed.payload_id,
        "version": listed.version,
        "release": listed.release,
        "fleet": listed.fleet,
        "components": [component.id for component in staged.manifest.components],
        "drive": note["drive"],
        "folder": note["folder"],
    }


def with_found(state: HostState, said: list[dict[str, Any]], at: Moment) -> HostState:
    """The state, with payloads that it does not know and that `found` tells of."""
    for one in said:
        if one["key"] not in state.payloads:
            state = _with(state, one, at)
    return state


def _with(state: HostState, one: Mapping[str, Any], at: Moment) -> HostState:
    folder = Path(one["folder"])
    drive = DriveRecord(one["drive"], INSTALLED, folder, state=DriveState.IDLE, since=at)
    record = PayloadRecord(
        key=one["key"],
        digest=one["digest"],
        payload_id=one["payload_id"],
        version=one["version"],
        release=one["release"],
        fleet=one["fleet"],
        step=Step.STORED,
        sources={drive.id: folder},
        phases={"seen": at},
    )
    record = component_names.named(state, record, one["components"])
    newest = state.highwater.get(record.payload_id)
    reached = Highwater(record.release, record.digest)
    if newest is not None and newest.release >= record.release:
        reached = newest
    return replace(
        state,
        drives={**state.drives, drive.id: drive},
        payloads={**state.payloads, record.key: record},
        highwater={**state.highwater, record.payload_id: reached},
    )

"""What is installed for good is told beside its files, so that it outlives the catalogue.

The note names the drive that stands for it.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from nondum.host.core.effects import NoteInstalled
from nondum.host.core.records.drive import INSTALLED, DriveRecord, DriveState
from nondum.host.core.records.moment import Moment
from nondum.host.core.records.payload import PayloadRecord
from nondum.host.core.records.step import Step
from nondum.host.core.state import Highwater, HostState
from nondum.host.core.transitions import KEEPS_FOLDER
from nondum.host.lifecycle import component_names, crash_attribution
from nondum.host.lifecycle.turn import Turn
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

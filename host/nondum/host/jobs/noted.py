"""Finds payloads that are installed for good by the notes beside their files.

Release, version and components are in its own files, which are hashed again before they are
believed.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from nondum.host.core import payload_key
from nondum.host.jobs.table import Arguments, Report
from nondum.sdk.errors import NondumError
from nondum.wheelhouse.format import contents
from nondum.wheelhouse.payload import payload


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

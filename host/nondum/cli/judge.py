"""What a payload says of itself; nothing is asked of a host."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from nondum.cli import render
from nondum.cli.connection import json_option
from nondum.cli.session import Session
from nondum.sdk.errors import PayloadRefused, Problem

if TYPE_CHECKING:
    from nondum.wheelhouse.payload.payload import StagedPayload
    from nondum.wheelhouse.trust.trust import Trust

FOLDER = click.Path(path_type=Path, exists=True, file_okay=False)
KEY = click.Path(path_type=Path, exists=True, dir_okay=False)


@click.command()
@click.argument("drive", type=FOLDER)
@json_option
@click.pass_obj
def inspect(session: Session, drive: Path) -> None:
    """Show what a drive or payload folder says it carries. Nothing is hashed or run.

    Example: nondum payload inspect /media/usb
    """
    views = [_view(loaded_payload(folder)) for folder in payloads(drive)]
    if session.as_json:
        render.as_json({"payloads": views})
        return
    for view in views:
        about = f"{view['id']} {view['version']} (release {view['release']}): {view['summary']}"
        render.sentence(f"{about}  {render.size(view['bytes'])}")
        by = f"signed by {', '.join(view['signers'])}" if view["signers"] else view["unsigned"]
        render.sentence(f"  built {view['built']} ({render.age(view['age_s'])} ago), {by}")
        for goal in view["goals"]:
            render.sentence(f"  goal: {goal}")
        for brought in view["data"]:
            told = f"{brought['name']} {brought['version']} ({brought['kind']})"
            render.sentence(f"  data {told}: {', '.join(brought['files'])}")
        for component in view["components"]:
            can = ", ".join(component["behaviours"]) or "no behaviours"
            render.sentence(f"  component {component['id']}: {can}")
            for wheel in component["wheels"]:
                render.sentence(f"    {wheel}")


def payloads(drive: Path) -> Iterator[Path]:
    """The payload folders of a drive, or the folder itself when it is one.

    Raises `PayloadRefused` (DRIVE_NOT_PAYLOAD).
    """
    from nondum.wheelhouse.format import contents
    from nondum.wheelhouse.payload.drive import find_payloads

    if (drive / contents.NAME).is_file():
        yield drive
        return
    found = find_payloads(drive)
    if not found:
        text = "there is no payload here"
        fix = "a drive has folders nondum/<payload-id>/ with a file CONTENTS"
        raise PayloadRefused(Problem("DRIVE_NOT_PAYLOAD", text, where=str(drive), fix=fix))
    yield from found


def loaded_payload(folder: Path) -> StagedPayload:
    """What a payload folder carries, not hashed. Raises `PayloadRefused`."""
    from nondum.wheelhouse.format import contents
    from nondum.wheelhouse.payload import drive
    from nondum.wheelhouse.payload.payload import load

    listed = contents.parse(drive.read_contents(folder), f"{folder.name}/{contents.NAME}")
    return load(folder, listed)


def size_of(folder: Path) -> str:
    """The size of all files in a folder, for people."""
    return render.size(sum(path.stat().st_size for path in folder.rglob("*") if path.is_file()))


def signed(folder: Path, trust: Trust | None = None) -> dict[str, Any]:
    """Whose signatures hold, by their names in a trust file or by fingerprints; else, why there is
    none. Whether they are trusted is not asked. Raises `PayloadRefused`, `DriveGone`.
    """
    from nondum.wheelhouse.payload import drive
    from nondum.wheelhouse.trust.judging import Circumstances, judge

    data, signature = drive.read_contents(folder), drive.read_signature(folder)
    verdict = judge(trust, data, signature, Circumstances())
    if verdict.signers:
        return {"signers": list(verdict.signers), "unsigned": ""}
    return {
        "signers": [],
        "unsigned": "not signed" if signature is None else str(verdict.problems[0]),
    }


def _view(payload: StagedPayload) -> dict[str, Any]:
    from nondum.host.trust.vouched import age_s

    listed = payload.contents
    return {
        "id": listed.payload_id,
        "version": listed.version,
        "release": listed.release,
        "fleet": listed.fleet,
        "built": listed.built,
        "age_s": age_s(listed.built),
        **signed(payload.folder),
        "summary": payload.manifest.summary,
        "bytes": listed.total_bytes,
        "goals": list(payload.goals),
        "data": [
            {"name": d.name, "kind": d.kind, "version": d.version, "files": list(d.files)}
            for d in payload.manifest.data
        ],
        "components": [
            {
                "id": component.id,
                "distribution": component.distribution,
                "data": [need.name for need in component.data],
                "behaviours": [b.name for b in payload.index[component.id].behaviours],
                "wheels": [wheel.filename for wheel in payload.locks[component.id].wheels],
            }
            for component in payload.manifest.components
        ],
    }

"""Commands that judge payloads; none needs a host."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from nondum.host.cli import render
from nondum.host.cli.connection import Session, json_option
from nondum.host.cli.failure import EXIT_PROBLEMS
from nondum.host.cli.progress import ProgressLine
from nondum.sdk.errors import PayloadRefused, Problem

if TYPE_CHECKING:
    from nondum.wheelhouse.payload import StagedPayload

FOLDER = click.Path(path_type=Path, exists=True, file_okay=False)


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
        render.sentence(f"  built {view['built']}, {by}")
        for component in view["components"]:
            can = ", ".join(component["behaviours"]) or "no behaviours"
            render.sentence(f"  component {component['id']}: {can}")
            for wheel in component["wheels"]:
                render.sentence(f"    {wheel}")


@click.command()
@click.argument("drive", type=FOLDER)
@click.option("--anywhere", is_flag=True, help="Do not ask whether it fits this machine.")
@json_option
@click.pass_obj
def check(session: Session, drive: Path, anywhere: bool) -> int:
    """Judge a drive or payload folder by the rules that hosts go by. Exits with 3 on problems.

    \b
    Examples: nondum payload check /media/usb
              nondum payload check drive --anywhere --json
    """
    problems: list[Problem] = []
    warnings: list[Problem] = []
    for folder in payloads(drive):
        with ProgressLine(folder.name, is_wanted=not session.as_json) as show:
            found, doubts = _judged(folder, show, anywhere=anywhere)
        problems.extend(found)
        warnings.extend(doubts)
    if session.as_json:
        render.as_json(
            {
                "ok": not problems,
                "problems": [problem.to_dict() for problem in problems],
                "warnings": [warning.to_dict() for warning in warnings],
            }
        )
    else:
        for problem in problems:
            render.sentence(str(problem), colour="red")
        for warning in warnings:
            render.sentence(str(warning), colour="yellow", mark="warning: ")
        click.echo("refused" if problems else "accepted")
    return EXIT_PROBLEMS if problems else 0


def payloads(drive: Path) -> Iterator[Path]:
    """The payload folders of a drive, or the folder itself when it is one.

    Raises `PayloadRefused` (DRIVE_NOT_PAYLOAD).
    """
    from nondum.wheelhouse import contents
    from nondum.wheelhouse.drive import find_payloads

    if (drive / contents.NAME).is_file():
        yield drive
        return
    found = find_payloads(drive)
    if not found:
        text = "there is no payload here"
        fix = "a drive has folders nondum/<payload-id>/ with a file CONTENTS"
        raise PayloadRefused(Problem("DRIVE_NOT_PAYLOAD", text, where=str(drive), fix=fix))
    yield from found


def _judged(
    folder: Path, show: ProgressLine, *, anywhere: bool
) -> tuple[tuple[Problem, ...], tuple[Problem, ...]]:
    """The problems of a payload, and its warnings."""
    from nondum.host import vocabulary_check
    from nondum.wheelhouse import preflight
    from nondum.wheelhouse.payload import verify_folder
    from nondum.wheelhouse.signatures import UnsignedAllowed

    facts = None if anywhere else preflight.probe(Path.cwd(), reserve_mb=0, confinement=0)
    problems = verify_folder(folder, UnsignedAllowed(), facts, show)
    if problems:
        return problems, ()
    judged = vocabulary_check.judge(loaded_payload(folder).index)
    return judged.problems, judged.warnings


def loaded_payload(folder: Path) -> StagedPayload:
    """What a payload folder carries, not hashed. Raises `PayloadRefused`."""
    from nondum.wheelhouse import contents, drive
    from nondum.wheelhouse.payload import load

    listed = contents.parse(drive.read_contents(folder), f"{folder.name}/{contents.NAME}")
    return load(folder, listed)


def _signed(folder: Path) -> dict[str, Any]:
    """The fingerprints of those whose signatures hold; else, why there is none."""
    from nondum.wheelhouse import drive
    from nondum.wheelhouse.trust.judging import Circumstances, judge

    data, signature = drive.read_contents(folder), drive.read_signature(folder)
    verdict = judge(None, data, signature, Circumstances())
    why = "not signed" if signature is None else str(verdict.problems[0])
    return {"signers": list(verdict.signers), "unsigned": "" if verdict.signers else why}


def _view(payload: StagedPayload) -> dict[str, Any]:
    listed = payload.contents
    return {
        "id": listed.payload_id,
        "version": listed.version,
        "release": listed.release,
        "fleet": listed.fleet,
        "built": listed.built,
        **_signed(payload.folder),
        "summary": payload.manifest.summary,
        "bytes": listed.total_bytes,
        "components": [
            {
                "id": component.id,
                "distribution": component.distribution,
                "behaviours": [b.name for b in payload.index[component.id].behaviours],
                "wheels": [wheel.filename for wheel in payload.locks[component.id].wheels],
            }
            for component in payload.manifest.components
        ],
    }

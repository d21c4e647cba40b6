"""`nondum payload data`: a drive that brings a model or a map. Making one needs no host."""

from __future__ import annotations

from pathlib import Path

import click

from nondum.cli import render
from nondum.cli.connection import json_option
from nondum.cli.judge import size_of
from nondum.cli.payload_options import Destination, written
from nondum.cli.progress import ProgressLine
from nondum.cli.session import Session


@click.command()
@click.argument(
    "files", metavar="FILE…", nargs=-1, required=True, type=click.Path(exists=True, path_type=Path)
)
@written
@click.option("--kind", required=True, help="What it is for: components ask for data by kind.")
@click.option("--name", help="What it is called [default: as its first file].")
@click.option("--version", default="1", show_default=True, help="Its version (PEP 440).")
@click.option("--id", "payload_id", help="The payload's id [default: org.example.NAME].")
@json_option
@click.pass_obj
def data(
    session: Session,
    files: tuple[Path, ...],
    to: Destination,
    kind: str,
    name: str | None,
    version: str,
    payload_id: str | None,
) -> None:
    """Put a model, a map or other data on a drive, for components that ask for such.

    A folder brings all files in it. Robots take data only from those whose role may give `data`:
    `nondum keys allow … --permission data`.

    \b
    Examples: nondum payload data yolo.onnx --kind onnx-detector -o /media/usb --sign alice
              nondum payload data maps/ --kind floor-plan --name hall --version 3 -o drive
    """
    from nondum.wheelhouse.build import data_payload

    called = name or data_payload.name_of(files[0])
    with ProgressLine(called, is_wanted=not session.as_json) as show:
        made = data_payload.write(
            to.output,
            payload_id or f"org.example.{called}",
            files,
            name=called,
            kind=kind,
            version=version,
            release=to.release,
            fleet=to.fleet,
            hosts=to.hosts,
            progress=show,
            finish=to.sign,
        )
    if session.as_json:
        render.as_json({"payloads": [str(made)]})
    else:
        click.echo(f"{made}  {size_of(made)}")

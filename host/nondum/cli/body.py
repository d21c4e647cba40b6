"""What the robot is made of, and what it can do."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import click

from nondum.cli import render
from nondum.cli.connection import json_option
from nondum.cli.session import Session
from nondum.cli.table import table
from nondum.planning.words.pattern import with_blanks


def show(session: Session, rows: list[dict[str, Any]], columns: Sequence[str], empty: str) -> None:
    """Print what the daemon answered: all of it in JSON, or some columns as a table."""
    if session.as_json:
        render.as_json(rows)
    else:
        table(session.short(rows), columns, empty=empty)


@click.command()
@json_option
@click.pass_obj
def components(session: Session) -> None:
    """What the robot is made of at this moment.

    A component's age is the time since its payload was built; of peers' it is not known.

    Example: nondum components
    """
    columns = ["component", "state", "plugin", "version", "payload", "age", "units"]
    columns += ["confinement", "problem"]
    rows = session.ask("components")
    if any(row["granted"] for row in rows):
        columns.insert(columns.index("confinement"), "granted")
    if any(row["was"] for row in rows):
        columns.insert(columns.index("age"), "release")
    if not session.as_json:
        rows = [
            {
                **row,
                "release": render.release(row),
                "age": render.age(row["age_s"]),
                "granted": ", ".join(f"{key} = {most}" for key, most in row["granted"].items()),
                "problem": render.without_excerpt(row["problem"]),
            }
            for row in rows
        ]
    show(session, rows, columns, "no components")


@click.command()
@json_option
@click.pass_obj
def behaviours(session: Session) -> None:
    """What the robot can do.

    Example: nondum behaviours
    """
    columns = ["behaviour", "component", "kind", "running", "phrases"]
    rows = session.ask("behaviours")
    if any(row["problem"] for row in rows):
        columns.append("problem")
    if not session.as_json:
        rows = [{**row, "phrases": list(map(with_blanks, row["phrases"]))} for row in rows]
    show(session, rows, columns, "no behaviours")


@click.command()
@json_option
@click.pass_obj
def units(session: Session) -> None:
    """What the robot has to act with.

    `xyz` (metres) and `rpy` (radians) say where a unit sits on the body, `mount` who said so.

    Example: nondum units
    """
    rows = session.ask("units")
    columns = ["unit", "type", "component", "ready", "xyz", "rpy", "mount"]
    show(session, rows, columns, "no units")
    if not session.as_json:
        for row in rows:
            for warning in row["warnings"]:
                render.sentence(warning, colour="yellow", mark="warning: ")


@click.command()
@json_option
@click.pass_obj
def store(session: Session) -> None:
    """The wheels and data that this host keeps.

    Example: nondum store
    """
    rows = session.ask("store")
    if session.as_json:
        render.as_json(rows)
        return
    shown = [
        {
            **row,
            "file": row["wheel"] or "data",
            "size": render.size(row["bytes"]),
            "sha256": row["sha256"][:12],
        }
        for row in rows
    ]
    table(shown, ["file", "size", "used_by", "sha256"], empty="the store is empty")
    if rows:
        files = "1 file" if len(rows) == 1 else f"{len(rows)} files"
        click.echo(f"{files}, {render.size(sum(row['bytes'] for row in rows))}")


@click.command()
@json_option
@click.pass_obj
def data(session: Session) -> None:
    """Models, maps and other data that are here, and which components see them.

    Example: nondum data
    """
    rows = session.ask("data")
    if not session.as_json:
        rows = [{**row, "size": render.size(row["bytes"])} for row in rows]
    show(session, rows, ["data", "kind", "version", "size", "payload", "shown_to"], "no data")

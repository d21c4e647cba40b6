"""Payloads that run on other hosts than the one that they are plugged into."""

from __future__ import annotations

from typing import Any

import click

from nondum.cli import complete, render
from nondum.cli.connection import json_option
from nondum.cli.session import Session
from nondum.cli.table import table


@click.command()
@click.argument("payload", required=False, shell_complete=complete.movable)
@click.argument("host", required=False, shell_complete=complete.peers)
@click.option("--here", is_flag=True, help="Let it run here again, if it fits.")
@json_option
@click.pass_obj
def place(session: Session, payload: str | None, host: str | None, here: bool) -> None:
    """Payloads that run on another host, and where one is to run.

    A payload that does not fit this host is handed to a peer that it fits, for as long as its drive
    is in. With HOST, a payload runs there or nowhere, also if it would fit here; that is kept. With
    --here it may run anywhere again, here first.

    \b
    Examples: nondum place
              nondum place org.example.detector mule
              nondum place org.example.detector --here
    """
    if payload is None:
        if here:
            raise click.UsageError("say which payload: nondum place PAYLOAD --here")
        show(session)
        return
    if here == (host is not None):
        raise click.UsageError("say where: nondum place PAYLOAD HOST, or --here")
    placed = session.ask("place", payload=payload, host=host)
    if session.as_json:
        render.as_json(placed)
    elif placed["host"] is None:
        told = "may run here again" if placed["before"] else "runs here whenever it fits"
        click.echo(f"{placed['payload']} {told}")
    else:
        click.echo(f"{placed['payload']} is to run on {placed['host']}: see `nondum place`")


def show(session: Session) -> None:
    """Print what runs elsewhere, and what waits to."""
    rows = session.ask("places")
    if session.as_json:
        render.as_json(rows)
        return
    shown = [
        {**row, "on": row["host"], "progress": render.progress(row["progress"])} for row in rows
    ]
    columns = ["payload", "version", "state", "on"]
    columns += [name for name in ("for", "pinned", "progress") if any(r[name] for r in shown)]
    table(shown, [*columns, "why"], empty="every payload runs where it is plugged in")
    for row in rows:
        _show_declined(row)


def _show_declined(row: dict[str, Any]) -> None:
    """Show why no host takes a payload, if no host has taken it."""
    if row["host"]:
        return
    for host, problems in row["declined"].items():
        for problem in problems:
            render.sentence(problem, colour="red", mark=f"{row['payload']} on {host}: ")

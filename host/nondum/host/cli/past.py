"""What has happened, and what was written."""

from __future__ import annotations

from typing import Any

import click

from nondum.host.cli import complete, render
from nondum.host.cli.connection import Session, json_option
from nondum.host.cli.table import cell, table

_LEFT_OUT = frozenset({"payload", "digest", "component"})
"""Details that a table has no room for: the subject says the same in words."""


@click.command()
@click.option(
    "--subject",
    shell_complete=complete.subjects,
    help="Only what is about this payload, component, drive, device or goal.",
)
@click.option(
    "--limit",
    default=200,
    show_default=True,
    type=click.IntRange(1, 100_000),
    help="The last so many rows.",
)
@json_option
@click.pass_obj
def journal(session: Session, subject: str | None, limit: int) -> None:
    """What happened on this host, oldest first.

    \b
    Examples: nondum journal --limit 20
              nondum journal --subject org.example.window-opener
    """
    rows = session.ask("journal", subject=subject, limit=limit)
    if session.as_json:
        render.as_json(rows)
        return
    rows = session.short(rows)
    shown = [{**row, "when": render.clock(row["when"]), "detail": _detail(row)} for row in rows]
    columns = ["when", "subject", "event", "step", "detail"]
    table(shown, columns, empty="the journal says nothing of it" if subject else "it is empty")


def _detail(row: dict[str, Any]) -> str:
    """What is wrong, or else what the row says beyond its subject."""
    problems = "; ".join(f"{p['code']} {p['message']}" for p in row["problems"])
    said = {
        key: value
        for key, value in row["detail"].items()
        if key not in _LEFT_OUT and value not in ("", [], {}, None, row["subject"])
    }
    return problems or cell(said)


@click.command()
@click.argument("component", required=False, shell_complete=complete.components)
@json_option
@click.pass_obj
def logs(session: Session, component: str | None) -> None:
    """What components have written.

    \b
    Examples: nondum logs
              nondum logs window-opener
    """
    rows = session.ask("logs", component=component)
    if session.as_json:
        render.as_json(rows)
        return
    if not rows:
        click.echo("nothing was written")
    for row in rows:
        colour = {"error": "red", "critical": "red", "warning": "yellow"}.get(row["level"].lower())
        where = f"{render.clock(row['when'])}  {row['component']}  {row['level']}  "
        render.sentence(row["message"], colour=colour, mark=where)

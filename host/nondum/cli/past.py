"""What has happened, and what was written."""

from __future__ import annotations

from typing import Any

import click

from nondum.cli import complete, live, render
from nondum.cli.connection import json_option
from nondum.cli.session import Session
from nondum.cli.table import cell, table

USUAL_ROWS, MOST_ROWS = 200, 100_000
_LEFT_OUT = frozenset({"payload", "digest", "component"})
"""Details that a table leaves out: the subject says the same in words."""


@click.command()
@click.option(
    "--subject",
    shell_complete=complete.subjects,
    help="Only what is about this payload, component, drive, device or goal.",
)
@click.option(
    "--limit",
    type=click.IntRange(1, MOST_ROWS),
    help="The number of rows, the last ones [default: 200; with --since all].",
)
@live.since_option
@live.follow_option(live.APPENDED)
@json_option
@click.pass_obj
def journal(
    session: Session, subject: str | None, limit: int | None, since_s: int | None, follow: bool
) -> None:
    """What happened on this host, oldest first.

    \b
    Examples: nondum journal --limit 20
              nondum journal --since 10min --follow
              nondum journal --subject org.example.window-opener
    """
    rows_wanted = limit or (MOST_ROWS if since_s else USUAL_ROWS)
    asked: dict[str, Any] = {"subject": subject, "limit": rows_wanted, "since_s": since_s}
    if follow:
        for row in session.follow("follow_journal", **asked):
            render.as_json_line(row) if session.as_json else _show_entry(session, row)
        return
    rows = session.ask("journal", **asked)
    if session.as_json:
        render.as_json(rows)
        return
    shown = [{**row, "when": render.clock(row["when"]), "detail": _detail(row)} for row in rows]
    shown = session.short(shown)
    columns = ["when", "subject", "event", "step", "detail"]
    if since_s:
        empty = "nothing happened since"
    else:
        empty = "the journal says nothing of it" if subject else "it is empty"
    table(shown, columns, empty=empty)


def _show_entry(session: Session, row: dict[str, Any]) -> None:
    """An entry as a line: what is still to come has no columns yet."""
    said = "  ".join(filter(None, [row["subject"], row["event"], row["step"], _detail(row)]))
    render.sentence(session.short(said, refresh=True), mark=f"{render.clock(row['when'])}  ")


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
@live.since_option
@live.follow_option(live.APPENDED)
@json_option
@click.pass_obj
def logs(session: Session, component: str | None, since_s: int | None, follow: bool) -> None:
    """What components have written.

    The last thousand lines of each are kept. Who follows more slowly than lines come misses some.

    \b
    Examples: nondum logs
              nondum logs --since 10min --follow
              nondum logs window-opener
    """
    if follow:
        for row in session.follow("follow_logs", component=component, since_s=since_s):
            render.as_json_line(row) if session.as_json else _show_line(row)
        return
    rows = session.ask("logs", component=component, since_s=since_s)
    if session.as_json:
        render.as_json(rows)
        return
    if not rows:
        render.sentence(_silent(session, component))
    for row in rows:
        _show_line(row)


def _silent(session: Session, component: str | None) -> str:
    """Who has written nothing, and since when it runs: that is how a healthy component looks."""
    known = [row for row in session.ask("components") if "@" not in row["component"]]
    asked = [row for row in known if component in (None, row["component"])]
    told = [
        f"{row['component']} runs since {render.moment(row['since'])}"
        if row["since"]
        else f"{row['component']} is {row['state']}"
        for row in asked
    ]
    return f"nothing was written: {', '.join(told) or 'no component is here'}"


def _show_line(row: dict[str, Any]) -> None:
    colour = {"error": "red", "critical": "red", "warning": "yellow"}.get(row["level"].lower())
    where = f"{render.clock(row['when'])}  {row['component']}  {row['level']}  "
    render.sentence(row["message"], colour=colour, mark=where)

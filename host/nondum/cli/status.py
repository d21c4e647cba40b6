"""The host at a glance."""

from __future__ import annotations

from functools import partial
from typing import Any

import click

from nondum.cli import live, render
from nondum.cli.connection import json_option
from nondum.cli.session import Session
from nondum.cli.table import table

LAST_TOLD = 5


@click.command()
@live.follow_option(live.REDRAWN)
@json_option
@click.pass_obj
def status(session: Session, follow: bool) -> None:
    """The host, its payloads and its goals at a glance.

    Of the machine, what it tells: battery, the disk that the state is on, the hottest sensor, and
    the load of the last minute. A payload's age is the time since it was built, as it says.

    With --follow and --json, each line is all that there is to see: components, streams, plan and
    tree too.

    \b
    Examples: nondum status
              nondum status --follow
    """
    if not follow:
        view = session.ask("status")
        render.as_json(view) if session.as_json else show(session.short(view))
        return
    for view in session.follow("watch"):
        if session.as_json:
            render.as_json_line(view)
        else:
            live.redraw(partial(show, session.short(view, refresh=True)))


def show(view: dict[str, Any]) -> None:
    """Print a status for people."""
    click.echo(f"host {view['host']}  revision {view['revision']}  {view['state']}")
    _show_machine(view["machine"])
    _show_feedback(view["feedback"])
    for warning in (*view["machine"]["warnings"], *view["warnings"]):
        render.sentence(warning, colour="yellow", mark="warning: ")
    _show_trust(view["trust"])
    _show_confinement(view["confinement"])
    click.echo()
    _show_payloads(view["payloads"])
    for drive in view["drives"]:
        for problem in drive["problems"]:
            render.sentence(problem, colour="red", mark=f"drive {drive['drive']}: ")
    if view["peers"]:
        names = ", ".join(row["peer"] for row in view["peers"])
        render.sentence(names, mark="peers: ")
    if view["goals"]:
        click.echo()
        columns = ["id", "text", "kind", "state", "reason"]
        table(list(map(render.goal, view["goals"])), columns, empty="")
    if view["told"]:
        click.echo()
    show_told(view["told"])


def show_told(told: list[dict[str, Any]]) -> None:
    """Print the last sentences that people were told, but for those of what is gone."""
    for row in [row for row in told if not row["over"]][-LAST_TOLD:]:
        render.sentence(row["text"], mark=f"> {render.moment(row['when'])}  ")


def _show_machine(machine: dict[str, Any]) -> None:
    if told := render.machine(machine):
        render.sentence(", ".join(told), mark="machine: ")


def _show_feedback(shown: dict[str, Any]) -> None:
    """What lamps and hooks show; that the host is ready stands in the first line."""
    if shown["state"] != "ready":
        code = f" ({shown['code']})" if shown["code"] else ""
        render.sentence(shown["sentence"], mark=f"shown: {shown['state']}{code}: ")


def _show_trust(trust: dict[str, Any] | None) -> None:
    if trust is not None:
        told = f"trust file of {trust['owner']}: version {trust['version']}"
        render.sentence(f"{told}; the first one is {trust['first']}")


def _show_confinement(confinement: dict[str, Any]) -> None:
    click.echo(f"confinement of workers: {confinement['level']} ({confinement['mechanism']})")
    for finding in confinement["missing"]:
        mark = f"{finding['level']} ({finding['mechanism']}): "
        why = "it is to be had, and not asked for" if finding["available"] else finding["reason"]
        render.sentence("; ".join(filter(None, (why, finding["fix"]))), mark=mark)


def _state(row: dict[str, Any]) -> str:
    if row["place"]:
        return "placed"
    if row["waits_for"]:
        return f"waits for {', '.join(row['waits_for'])}"
    return str(row["state"])


def _show_payloads(payloads: list[dict[str, Any]]) -> None:
    rows = [
        {
            **row,
            "state": _state(row),
            "on": row["place"],
            "release": render.release(row),
            "progress": render.progress(row["progress"]),
            "signed by": ", ".join(row["signers"]),
            "age": render.age(row["age_s"]),
        }
        for row in payloads
    ]
    columns = ["payload", "version", "age", "state", "drive", "components"]
    if any(row["was"] or row["state"] == "superseded" for row in rows):
        columns.insert(columns.index("age"), "release")
    if any(row["on"] for row in rows):
        columns.insert(columns.index("drive"), "on")
    if any(row["signers"] for row in rows):
        columns.append("signed by")
    if any(row["progress"] for row in rows):
        columns.append("progress")
    table(rows, columns, empty="no payloads")
    for row in rows:
        for problem in () if row["place"] else row["problems"]:
            render.sentence(problem, colour="red", mark=f"{row['payload']}: ")

"""Other hosts: which are here, which this host trusts, and why one is not here."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import click

from nondum.cli import peers_pair, peers_trust, render
from nondum.cli.connection import json_option
from nondum.cli.session import Session
from nondum.cli.table import table

Row = dict[str, Any]


@click.group(invoke_without_command=True)
@click.option("--why", is_flag=True, help="Show what was announced, heard, dialled and refused.")
@json_option
@click.pass_context
def peers(ctx: click.Context, why: bool) -> None:
    """Other hosts: which are here, and which this host trusts.

    \b
    Examples: nondum peers
              nondum peers --why
              nondum peers pair
    """
    if ctx.invoked_subcommand is None:
        show_why(ctx.obj) if why else show(ctx.obj)


def show(session: Session) -> None:
    """Print who is here."""
    rows = session.ask("peers")
    if session.as_json:
        render.as_json(rows)
        return
    shown = [
        {**row, "components": len(row["components"]), "computes": _compute(row["compute"])}
        for row in rows
    ]
    columns = ["peer", "state", "by", "address", "round_trip_ms", "components", "computes"]
    table(shown, columns, empty="no other host is here, and none is trusted")
    for row in rows:
        for problem in row["problems"]:
            render.sentence(problem, colour="yellow", mark=f"{row['peer']}: ")


def show_why(session: Session) -> None:
    """Print all that bears on who is here and who is not."""
    view = session.ask("peers_why")
    if session.as_json:
        render.as_json(view)
        return
    click.echo(f"links are secured by {view['security']}")
    if view["process"] is not None:
        click.echo(f"links are held by a separate process ({view['process']})")
    for problem in view["problems"]:
        render.sentence(problem, colour="red", mark="problem: ")
    for host in view["hosts"]:
        click.echo()
        for line in _host(host):
            render.sentence(line)
    _section(
        "announced and heard on",
        view["interfaces"],
        ["interface", "addresses", "is_looked_on", "announced_ago_s", "heard", "heard_ago_s"],
    )
    _section("asked for by name", view["static"], ["host", "asked", "answered_ago_s", "problem"])
    counts = [{"why": why, "times": times} for why, times in view["refused"].items()]
    _section("turned away", counts, ["why", "times"])
    _section("of those, the last", view["latest"][-10:], ["reason", "address", "told", "ago_s"])


def _section(title: str, rows: list[Row], columns: list[str]) -> None:
    if rows:
        click.echo(f"\n{title}:")
        table(rows, columns, empty="")


def _host(host: Row) -> Iterator[str]:
    """One host, line by line."""
    where = f" at {host['address']}" if host["address"] else ""
    yield f"{host['peer'] or 'a host'} ({host['fingerprint']}) is {host['state']}{where}"
    yield f"  its key: {host['standing']}"
    for hint in host["announced"]:
        on = f" on {hint['interface']}" if hint["interface"] else ""
        yield f"  announced by {hint['by']}{on}: {_listed(hint['addresses'])}"
    for address, problem in host["dialled"].items():
        yield f"  dialled {address}: {problem}"
    if host["round_trip_ms"] is not None:
        yield f"  here for {host['here_s']:g} s, round trip {host['round_trip_ms']:g} ms"
    if host["losses"]:
        yield f"  lost {host['losses']} times, the last time because {host['lost']}"


def _compute(compute: Row) -> str:
    """What a host has to compute with, in a few words."""
    if not compute:
        return ""
    gpu = compute.get("gpu_memory_mb")
    words = [
        str(compute.get("machine", "")),
        f"{compute.get('processors', '?')} processors",
        f"{compute.get('memory_mb', '?')} MB",
        f"GPU {gpu} MB{_kinds(compute)}" if gpu else "no GPU",
    ]
    return _listed(words)


def _kinds(compute: Row) -> str:
    kinds = compute.get("gpu_kinds")
    return f" ({', '.join(map(str, kinds))})" if isinstance(kinds, list) and kinds else ""


def _listed(words: Iterable[str]) -> str:
    return ", ".join(filter(None, words))


for command in (
    peers_pair.pair,
    peers_trust.trust,
    peers_trust.revoke,
    peers_trust.forget,
    peers_trust.key,
    peers_trust.certify,
    peers_trust.trust_fleet,
):
    peers.add_command(command)

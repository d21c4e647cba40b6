"""Commands that look at a running host and change nothing."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import click

from nondum.host.cli import render
from nondum.host.cli.connection import connect, json_option


def _ask(ctx: click.Context, verb: str, **arguments: Any) -> Any:
    with connect(ctx.obj) as client:
        return client.ask(verb, **arguments)


def _show_rows(
    ctx: click.Context, verb: str, columns: Sequence[str], empty: str, **arguments: Any
) -> None:
    as_json = arguments.pop("as_json")
    rows = _ask(ctx, verb, **arguments)
    if as_json:
        render.as_json(rows)
    else:
        render.table(rows, columns, empty=empty)


@click.command()
@json_option
@click.pass_context
def status(ctx: click.Context, as_json: bool) -> None:
    """The host, its payloads and its task at a glance.

    Example: nondum status --json
    """
    view = _ask(ctx, "status")
    if as_json:
        render.as_json(view)
        return
    click.echo(f"host {view['host']}  revision {view['revision']}  {view['state']}")
    for warning in view["warnings"]:
        click.secho(f"warning: {warning}", fg="yellow")
    render.table(view["payloads"], ["payload", "version", "state", "drive"], empty="no payloads")
    for payload in view["payloads"]:
        for problem in payload["problems"]:
            click.secho(f"  {payload['payload']}: {problem}", fg="red")
    for given in view["goals"]:
        click.echo(f"goal {given['id']}  {given['goal']}  {given['state']}  {given['reason']}")
    for told in view["told"][-5:]:
        click.echo(f"> {told}")


@click.command()
@json_option
@click.pass_context
def components(ctx: click.Context, as_json: bool) -> None:
    """What the robot is made of at this moment.

    Example: nondum components
    """
    _show_rows(
        ctx,
        "components",
        ["component", "state", "plugin", "version", "payload", "units", "problem"],
        "no components",
        as_json=as_json,
    )


@click.command()
@json_option
@click.pass_context
def behaviours(ctx: click.Context, as_json: bool) -> None:
    """What the robot can do.

    Example: nondum behaviours
    """
    columns = ["behaviour", "component", "kind", "running", "phrases"]
    _show_rows(ctx, "behaviours", columns, "no behaviours", as_json=as_json)


@click.command()
@json_option
@click.pass_context
def units(ctx: click.Context, as_json: bool) -> None:
    """What the robot has to act with.

    Example: nondum units
    """
    columns = ["unit", "type", "component", "ready", "xyz", "rpy"]
    _show_rows(ctx, "units", columns, "no units", as_json=as_json)


@click.command()
@json_option
@click.pass_context
def streams(ctx: click.Context, as_json: bool) -> None:
    """Who sends what to whom.

    Example: nondum streams
    """
    columns = ["stream", "type", "component", "flowing", "consumers"]
    _show_rows(ctx, "streams", columns, "no streams", as_json=as_json)


@click.command()
@click.option("--why", metavar="FACT", help="Only this fact, and where it comes from.")
@json_option
@click.pass_context
def facts(ctx: click.Context, as_json: bool, why: str | None) -> None:
    """What the robot believes, and why.

    Example: nondum facts --why "(ready panther__eye__camera)"
    """
    columns = ["fact", "source", "value"]
    _show_rows(ctx, "facts", columns, "nothing is believed", as_json=as_json, why=why)


@click.command()
@json_option
@click.pass_context
def goals(ctx: click.Context, as_json: bool) -> None:
    """What can be asked for now, and what was.

    Example: nondum goals
    """
    view = _ask(ctx, "goals")
    if as_json:
        render.as_json(view)
        return
    render.table(view["can"], ["words", "goal", "kind"], empty="nothing can be asked for yet")
    render.table(view["given"], ["id", "goal", "kind", "state", "reason"], empty="no goal given")


@click.command()
@json_option
@click.pass_context
def plan(ctx: click.Context, as_json: bool) -> None:
    """The plan that is being carried out.

    Example: nondum plan
    """
    view = _ask(ctx, "plan")
    if as_json:
        render.as_json(view)
        return
    if view.get("goal"):
        click.echo(f"goal {view['goal']}")
    render.table(view["steps"], ["step", "action", "state", "why"], empty="no plan")


@click.command()
@click.option("--follow", "-f", is_flag=True, help="Draw it again whenever it changes.")
@json_option
@click.pass_context
def tree(ctx: click.Context, as_json: bool, follow: bool) -> None:
    """The behaviour tree as it is being ticked.

    Example: nondum tree --follow
    """
    if not follow:
        view = _ask(ctx, "tree")
        render.as_json(view) if as_json else click.echo("\n".join(render.tree_lines(view)))
        return
    with connect(ctx.obj, timeout_s=None) as client:
        for view in client.follow("follow_tree"):
            if as_json:
                render.as_json(view)
            else:
                click.clear()
                click.echo("\n".join(render.tree_lines(view)))


@click.command()
@json_option
@click.pass_context
def why(ctx: click.Context, as_json: bool) -> None:
    """Why the robot does what it does, or why it cannot.

    Example: nondum why
    """
    view = _ask(ctx, "why")
    if as_json:
        render.as_json(view)
        return
    for sentence in view["sentences"]:
        click.echo(sentence)
    for problem in view["problems"]:
        click.secho(problem, fg="red")


@click.command()
@click.option("--subject", help="Only rows about this payload, component or drive.")
@click.option("--limit", default=200, show_default=True, help="The last so many rows.")
@json_option
@click.pass_context
def journal(ctx: click.Context, as_json: bool, subject: str | None, limit: int) -> None:
    """What happened on this host, oldest first.

    Example: nondum journal --subject org.nondum.speaker
    """
    columns = ["when", "subject", "event", "detail"]
    rows = _ask(ctx, "journal", subject=subject, limit=limit)
    if as_json:
        render.as_json(rows)
        return
    for row in rows:
        row["when"] = time.strftime("%F %T", time.localtime(row["when"]))
    render.table(rows, columns, empty="the journal is empty")


@click.command()
@click.argument("component", required=False)
@json_option
@click.pass_context
def logs(ctx: click.Context, as_json: bool, component: str | None) -> None:
    """What components have written.

    Example: nondum logs speaker
    """
    columns = ["component", "level", "message"]
    _show_rows(ctx, "logs", columns, "nothing was written", as_json=as_json, component=component)


@click.command()
@json_option
@click.pass_context
def store(ctx: click.Context, as_json: bool) -> None:
    """The wheels that this host keeps.

    Example: nondum store
    """
    columns = ["wheel", "bytes", "files", "sha256"]
    _show_rows(ctx, "store", columns, "the store is empty", as_json=as_json)

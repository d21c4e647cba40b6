"""What the robot believes, wants and does, and why."""

from __future__ import annotations

import click

from nondum.host.cli import render
from nondum.host.cli.body import show
from nondum.host.cli.connection import Session, json_option
from nondum.host.cli.table import cell, table


@click.command()
@click.option(
    "--why",
    metavar="FACT",
    help="Only this fact, true or not, with every reason.",
)
@json_option
@click.pass_obj
def facts(session: Session, why: str | None) -> None:
    """What the robot believes, and why.

    \b
    Examples: nondum facts
              nondum facts --why "(ready panther__eye__camera)"
    """
    rows = session.ask("facts", why=why)
    if why is None or session.as_json:
        show(session, rows, ["fact", "source", "value"], "nothing is believed")
        return
    for row in rows:
        render.sentence(row["source"])
    if rows and rows[0]["value"] is not None:
        render.sentence(f"its value: {cell(rows[0]['value'])}")


@click.command()
@json_option
@click.pass_obj
def goals(session: Session) -> None:
    """What can be asked for now, and what was.

    Example: nondum goals
    """
    view = session.ask("goals")
    if session.as_json:
        render.as_json(view)
        return
    table(view["can"], ["words", "goal", "kind"], empty="nothing can be asked for yet")
    click.echo()
    columns = ["id", "text", "goal", "kind", "state", "reason"]
    table(view["given"], columns, empty="no goal was given")


@click.command()
@json_option
@click.pass_obj
def plan(session: Session) -> None:
    """The plan that is being carried out.

    Example: nondum plan
    """
    view = session.ask("plan")
    if session.as_json:
        render.as_json(view)
        return
    if view["goal"]:
        click.echo(f"goal {view['id']}  {view['goal']}  {view['kind']}")
    table(view["steps"], ["step", "action", "state", "why"], empty="no plan")


@click.command()
@click.option("--follow", "-f", is_flag=True, help="Draw it again whenever it changes.")
@json_option
@click.pass_obj
def tree(session: Session, follow: bool) -> None:
    """The behaviour tree as it is being ticked.

    \b
    Examples: nondum tree
              nondum tree --follow
    """
    if not follow:
        view = session.ask("tree")
        render.as_json(view) if session.as_json else click.echo("\n".join(render.tree_lines(view)))
        return
    for view in session.follow("follow_tree"):
        if session.as_json:
            render.as_json_line(view)
        else:
            click.clear()
            click.echo("\n".join(render.tree_lines(view)))


@click.command()
@json_option
@click.pass_obj
def why(session: Session) -> None:
    """Why the robot does what it does, or why it cannot.

    Example: nondum why
    """
    view = session.ask("why")
    if session.as_json:
        render.as_json(view)
        return
    for sentence in view["sentences"]:
        render.sentence(sentence)
    for problem in view["problems"]:
        render.sentence(problem, colour="red")
    if view["told"]:
        click.echo()
    for told in view["told"]:
        render.sentence(told, mark="> ")

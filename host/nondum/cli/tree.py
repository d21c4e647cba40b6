"""The behaviour tree, drawn for people, and for the tools that people look at trees with."""

from __future__ import annotations

from typing import Any

import click

from nondum.cli import live, render
from nondum.cli.connection import json_option
from nondum.cli.outline import outline
from nondum.cli.session import Session
from nondum.cli.table import shown_width


@click.command()
@live.follow_option(live.REDRAWN, "--watch")
@click.option("--graphviz", is_flag=True, help="Print a graph in Graphviz's DOT language.")
@click.option("--groot", is_flag=True, help="Print XML for Groot2 (BehaviorTree.CPP 4).")
@json_option
@click.pass_obj
def tree(session: Session, follow: bool, graphviz: bool, groot: bool) -> None:
    """The behaviour tree as it is being ticked, and why.

    Each step of the plan says where it is (done, skipped, running, kept, halting, next, waiting or
    excluded), what it waits for, what needs it, what it locks, and what it was chosen over.

    \b
    Examples: nondum tree
              nondum tree --follow
              nondum tree --graphviz | dot -Tsvg > tree.svg
              nondum tree --groot > tree.xml
    """
    if follow + graphviz + groot > 1 or ((graphviz or groot) and session.as_json):
        ways = "--follow, --graphviz, --groot, --json"
        raise click.UsageError(f"one way of drawing at a time: {ways}")
    if follow:
        _follow(session)
        return
    view = session.ask("tree")
    if session.as_json:
        render.as_json(view)
    elif graphviz or groot:
        click.echo(_drawn(view, as_dot=graphviz), nl=False)
    else:
        click.echo("\n".join(outline(session.short(view), width=shown_width())))


def _drawn(view: dict[str, Any], *, as_dot: bool) -> str:
    if as_dot:
        from nondum.cli.graphviz import graphviz

        return graphviz(view)
    from nondum.cli.groot import groot

    return groot(view)


def _follow(session: Session) -> None:
    """Draw again at the daemon's word: in the same place on a terminal, below anywhere else."""
    for view in session.follow("follow_tree"):
        if session.as_json:
            render.as_json_line(view)
            continue
        view = session.short(view, refresh=True)
        if live.is_screen():
            live.draw(outline(view, width=shown_width()))
        else:
            click.echo("\n".join([*outline(view), ""]))

"""The behaviour tree, drawn for people, and for the tools that people look at trees with."""

from __future__ import annotations

import shutil
import sys
from typing import Any

import click

from nondum.host.cli import render
from nondum.host.cli.connection import Session, json_option
from nondum.host.cli.outline import outline
from nondum.host.cli.table import shown_width

_TO_HOME, _TO_LINE_END, _TO_SCREEN_END = "\x1b[H", "\x1b[K", "\x1b[J"


@click.command()
@click.option(
    "--watch", "--follow", "-f", "watch", is_flag=True, help="Draw it again whenever it changes."
)
@click.option("--graphviz", is_flag=True, help="Print a graph in Graphviz's DOT language.")
@click.option("--groot", is_flag=True, help="Print XML for Groot2 (BehaviorTree.CPP 4).")
@json_option
@click.pass_obj
def tree(session: Session, watch: bool, graphviz: bool, groot: bool) -> None:
    """The behaviour tree as it is being ticked, and why.

    Each step of the plan says where it is (done, skipped, running, kept, halting, next, waiting or
    excluded), what it waits for, what needs it, what it locks, and what it was chosen over.

    \b
    Examples: nondum tree
              nondum tree --watch
              nondum tree --graphviz | dot -Tsvg > tree.svg
              nondum tree --groot > tree.xml
    """
    if watch + graphviz + groot > 1 or ((graphviz or groot) and session.as_json):
        raise click.UsageError("one way of drawing at a time: --watch, --graphviz, --groot, --json")
    if watch:
        _watch(session)
        return
    view = session.ask("tree")
    if session.as_json:
        render.as_json(view)
    else:
        click.echo(_drawn(view, as_dot=graphviz, as_xml=groot), nl=False)


def _drawn(view: dict[str, Any], *, as_dot: bool, as_xml: bool) -> str:
    if as_dot:
        from nondum.host.cli.graphviz import graphviz

        return graphviz(view)
    if as_xml:
        from nondum.host.cli.groot import groot

        return groot(view)
    return "\n".join(outline(view, width=shown_width())) + "\n"


def _watch(session: Session) -> None:
    """Draw again at the daemon's word: in the same place on a terminal, below anywhere else."""
    for view in session.follow("follow_tree"):
        if session.as_json:
            render.as_json_line(view)
        elif sys.stdout.isatty():
            click.echo(_screen(outline(view, width=shown_width())), nl=False)
        else:
            click.echo("\n".join([*outline(view), ""]))


def _screen(lines: list[str]) -> str:
    """The lines over what is shown now, without blanking it first; what does not fit is counted."""
    room = shutil.get_terminal_size().lines - 1
    if len(lines) > room:
        lines = [*lines[: room - 1], f"… {len(lines) - room + 1} more lines"]
    shown = "".join(f"{line}{_TO_LINE_END}\n" for line in lines)
    return f"{_TO_HOME}{shown}{_TO_SCREEN_END}"

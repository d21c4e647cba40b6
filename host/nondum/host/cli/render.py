"""Tables and trees as text: boxed and coloured on a terminal, plain columns in a pipe."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping, Sequence
from typing import Any

import click

Row = Mapping[str, Any]

STATUS_MARK = {"SUCCESS": "✓", "FAILURE": "✗", "RUNNING": "▶", "INVALID": "·"}


def as_json(data: Any) -> None:
    """Print data for machines."""
    click.echo(json.dumps(data, ensure_ascii=False, indent=2))


def table(rows: Sequence[Row], columns: Sequence[str], *, empty: str) -> None:
    """Print rows under their columns' names, or the sentence `empty`."""
    if not rows:
        click.echo(empty)
        return
    cells = [[cell(row.get(column)) for column in columns] for row in rows]
    if sys.stdout.isatty():
        _boxed(columns, cells)
        return
    widths = [max(len(c), *(len(line[i]) for line in cells)) for i, c in enumerate(columns)]
    for line in ([c.upper() for c in columns], *cells):
        click.echo("  ".join(f"{v:<{w}}" for v, w in zip(line, widths, strict=True)).rstrip())


def cell(value: Any) -> str:
    """One value as a table shows it.

    >>> cell(None), cell(True), cell(["a", "b"]), cell(1.23456)
    ('-', 'yes', 'a, b', '1.235')
    """
    if value is None or value == "" or value == []:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list | tuple):
        return ", ".join(cell(item) for item in value)
    if isinstance(value, Mapping):
        return ", ".join(f"{key}={cell(item)}" for key, item in value.items())
    return str(value)


def tree_lines(node: Mapping[str, Any], depth: int = 0) -> list[str]:
    """A behaviour tree as indented lines: status, name, and why it is where it is."""
    mark = STATUS_MARK.get(str(node.get("status")), "·")
    why = f"  — {node['why']}" if node.get("why") else ""
    lines = [f"{'  ' * depth}{mark} {node['name']}{why}"]
    for child in node.get("children", ()):
        lines.extend(tree_lines(child, depth + 1))
    return lines


def _boxed(columns: Sequence[str], cells: Sequence[Sequence[str]]) -> None:
    # Only a terminal pays for rich's import.
    from rich.box import SIMPLE_HEAD
    from rich.console import Console
    from rich.table import Table

    drawn = Table(box=SIMPLE_HEAD, pad_edge=False)
    for column in columns:
        drawn.add_column(column.capitalize(), overflow="fold")
    for line in cells:
        drawn.add_row(*line)
    Console(markup=False, highlight=False).print(drawn)

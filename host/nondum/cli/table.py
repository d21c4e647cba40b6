"""Tables as text: as wide as they need to be in a pipe, folded to fit on a terminal."""

from __future__ import annotations

import shutil
import textwrap
from collections.abc import Mapping, Sequence
from itertools import zip_longest
from typing import Any

import click

from nondum.host.core.printable import printable

Row = Mapping[str, Any]

GAP = 2
NARROWEST = 8
"""Characters that a folded column keeps."""

COLOURS = {
    "active": "green",
    "done": "green",
    "flowing": "green",
    "ready": "green",
    "reached": "green",
    "running": "green",
    "failed": "red",
    "quarantined": "red",
    "refused": "red",
    "queued": "yellow",
    "restarting": "yellow",
    "suspended": "yellow",
}
"""Words that a terminal shows in colour, where a cell is no more than that word."""


def table(rows: Sequence[Row], columns: Sequence[str], *, empty: str) -> None:
    """Print rows under their columns' names, or the sentence `empty`."""
    if not rows:
        click.echo(empty)
        return
    click.echo("\n".join(lines(rows, columns, width=shown_width())))


def shown_width() -> int | None:
    """Characters that fit a line; None in a pipe, where nothing is folded."""
    return shutil.get_terminal_size(fallback=(0, 0)).columns or None


def lines(rows: Sequence[Row], columns: Sequence[str], *, width: int | None) -> list[str]:
    """The lines of a table, folded to a width if one is given.

    >>> for line in lines([{"unit": "eye", "ready": True}], ["unit", "ready"], width=None):
    ...     print(click.unstyle(line))
    UNIT  READY
    eye   yes
    """
    cells = [[cell(row.get(column)) for column in columns] for row in rows]
    natural = [max(len(c), *(len(line[i]) for line in cells)) for i, c in enumerate(columns)]
    widths = natural if width is None else fitted(natural, width)
    heads = [_folded(c.upper(), w)[0] for c, w in zip(columns, widths, strict=True)]
    shown = [click.style(_joined(heads, widths), bold=True)]
    for line in cells:
        folded = [_folded(text, w) for text, w in zip(line, widths, strict=True)]
        shown.extend(_joined(parts, widths) for parts in zip_longest(*folded, fillvalue=""))
    return shown


def fitted(natural: Sequence[int], width: int) -> list[int]:
    """Column widths within `width`: the widest give way first, none below `NARROWEST`.

    >>> fitted([4, 30, 50], 60)
    [4, 26, 26]
    """
    widths = list(natural)
    space = width - GAP * (len(widths) - 1)
    while sum(widths) > space and (widest := max(widths)) > NARROWEST:
        wide = [i for i, w in enumerate(widths) if w == widest]
        lower = max([NARROWEST, *(w for w in widths if w < widest)])
        excess = -(-(sum(widths) - space) // len(wide))
        for i in wide:
            widths[i] = max(lower, widest - excess)
    return widths


def cell(value: Any) -> str:
    """One value as a table shows it, safe for a terminal.

    >>> cell(None), cell(True), cell(["a", "b"]), cell(1.23456), cell({"x": 1.0})
    ('-', 'yes', 'a, b', '1.235', 'x=1')
    """
    match value:
        case None | "" | [] | ():
            return "-"
        case bool():
            return "yes" if value else "no"
        case float():
            return f"{value:.4g}"
        case list() | tuple():
            return ", ".join(cell(item) for item in value)
        case Mapping():
            return ", ".join(f"{printable(str(k))}={cell(item)}" for k, item in value.items())
        case _:
            return " ".join(printable(line) for line in str(value).splitlines())


def _folded(text: str, width: int) -> list[str]:
    return textwrap.wrap(text, width, break_on_hyphens=False) or [""]


def _joined(parts: Sequence[str], widths: Sequence[int]) -> str:
    padded = (f"{_coloured(p)}{' ' * (w - len(p))}" for p, w in zip(parts, widths, strict=True))
    return (" " * GAP).join(padded).rstrip()


def _coloured(text: str) -> str:
    return click.style(text, fg=COLOURS[text]) if text in COLOURS else text

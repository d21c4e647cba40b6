"""Figures in the tables of docs/benchmarks, found by the words that stand beside them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

PAGES = Path(__file__).parents[2] / "docs/benchmarks"
_NUMBER = re.compile(r"-?\d[\d,]*(?:\.\d+)?")


class CellMissing(Exception):
    """There is no such page, table, row or column, or no number in the cell."""


@dataclass(frozen=True, slots=True)
class Cell:
    """Where a figure stands."""

    page: str
    """Name of the page, without its ending."""
    row: tuple[str, ...]
    """What its row begins with."""
    column: str
    """Its column's title, or how the first such title begins."""
    section: str = ""
    """Beginning of the title of the page's part, if several have such a row and column."""

    def text(self, pages: Path = PAGES) -> str:
        """What stands there. Raises `CellMissing`."""
        path = pages / f"{self.page}.md"
        if not path.exists():
            raise CellMissing(f"{path.name} is not there")
        for section, header, row in rows(path.read_text(encoding="utf-8")):
            named = [title for title in header if title.startswith(self.column)]
            is_it = section.startswith(self.section) and tuple(row[: len(self.row)]) == self.row
            if is_it and named:
                return row[header.index(self.column if self.column in named else named[0])]
        raise CellMissing(f"{path.name} has no row {self.row} with the column {self.column!r}")

    def number(self, pages: Path = PAGES) -> float:
        """The first number that stands there: of a spread, the median. Raises `CellMissing`."""
        text = self.text(pages)
        found = _NUMBER.search(text)
        if found is None:
            raise CellMissing(f"{self.page}.md: no number in {text!r}")
        return float(found[0].replace(",", ""))


def rows(page: str) -> Iterator[tuple[str, Sequence[str], Sequence[str]]]:
    """Each row of each table of a Markdown page, with its section's title and its table's header.

    >>> page = "## S\\n| a | b |\\n|---|--:|\\n| 1 | 2 (1-3) |\\n"
    >>> list(rows(page))
    [('S', ['a', 'b'], ['1', '2 (1-3)'])]
    """
    section, header = "", None
    for line in page.splitlines():
        if line.startswith("#"):
            section = line.lstrip("#").strip()
        if not line.startswith("|"):
            header = None
            continue
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
        if header is None:
            header = cells
        elif not set(line) <= set("|-: "):
            yield section, header, cells

"""What the benchmarks are to show, beside what their pages show: `python -m benchmarks.aims`.

Measures nothing: it reads the pages of docs/benchmarks and `aims.toml`, and writes
docs/benchmarks/README.md.
"""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks import measuring
from benchmarks.aims.cells import PAGES, Cell, CellMissing

LIST = Path(__file__).with_name("aims.toml")
NOT_MEASURED = "not measured"


@dataclass(frozen=True, slots=True)
class Aim:
    """A figure that a benchmark is to show."""

    work: str
    cell: Cell
    at_most: float | None = None
    at_least: float | None = None
    over: Cell | None = None
    """What the figure is divided by, if the page tells both and not their ratio."""
    why: str = ""
    """If it is not reached: where the rest goes, and the least that was found possible."""

    @property
    def told(self) -> str:
        """The limit."""
        return f"≤ {self.at_most:g}" if self.at_most is not None else f"≥ {self.at_least:g}"

    def shown(self, pages: Path = PAGES) -> Shown | None:
        """What its page shows; None: nothing yet."""
        try:
            figure = self.cell.number(pages)
            if self.over is None:
                return Shown(self.cell.text(pages), self._holds(figure))
            figure /= self.over.number(pages)
            return Shown(f"{figure:.2f}", self._holds(figure))
        except CellMissing:
            return None

    def _holds(self, figure: float) -> bool:
        return (self.at_most is None or figure <= self.at_most) and (
            self.at_least is None or figure >= self.at_least
        )


@dataclass(frozen=True, slots=True)
class Shown:
    """A figure that a page has."""

    text: str
    """With its spread, if it has one."""
    is_reached: bool
    """Whether it is within the aim."""


def aims() -> list[Aim]:
    """All of them, in the order of `aims.toml`."""
    with LIST.open("rb") as file:
        return [_aim(row) for row in tomllib.load(file)["aim"]]


def page(found: Sequence[Aim]) -> str:
    """The page."""
    header = ["work", "aim", "shown", "reached", "page", "if not: why, and the least possible"]
    rows = [[aim.work, aim.told, *_row(aim)] for aim in found]
    return f"""# How quick nondum is to be, and how quick it is

`python -m benchmarks.aims` wrote this page of `benchmarks/aims/aims.toml` and of the pages that it
names; how each was measured stands there, with the machine. A figure is a median, with the least
and the greatest behind it, or a ratio of two of one run. “÷” means: nondum's, divided by the
other's.

{measuring.table(header, rows)}
"""


def _row(aim: Aim) -> tuple[str, str, str, str]:
    shown, page_name = aim.shown(), aim.cell.page
    if shown is None:
        return NOT_MEASURED, "", page_name, aim.why
    link = f"[{page_name}]({page_name}.md)"
    if shown.is_reached:
        return shown.text, "yes", link, ""
    return shown.text, "**no**", link, aim.why


def _aim(row: dict[str, Any]) -> Aim:
    cell = _cell(row, {})
    over = _cell(row, row["over"]) if "over" in row else None
    limits = {key: row[key] for key in ("at_most", "at_least") if key in row}
    return Aim(row["work"], cell, over=over, why=row.get("why", ""), **limits)


def _cell(row: dict[str, Any], other: dict[str, Any]) -> Cell:
    told = {**row, **other}
    return Cell(told["page"], tuple(told["row"]), told["column"], told.get("section", ""))


def main() -> None:
    """Write the page."""
    measuring.write("README", page(aims()))


if __name__ == "__main__":
    main()

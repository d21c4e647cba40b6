"""The page of aims says what the pages of the benchmarks show, and why what is missed is missed."""

from __future__ import annotations

from pathlib import Path

import pytest
from benchmarks.aims.__main__ import Aim, Shown, aims, page
from benchmarks.aims.cells import PAGES, Cell, CellMissing

TEXT = """# Title

## One

| what | way | ms | all, load 3 |
|------|-----|---:|---:|
| small | ours | 1,020 (900-2000) | 2.5 |

## Two

| what | way | ms |
|---|---|---|
| small | ours | 0.5 (0.4-0.6) |
| small | theirs | 2 |
"""


@pytest.fixture
def pages(tmp_path: Path) -> Path:
    (tmp_path / "figures.md").write_text(TEXT, encoding="utf-8")
    return tmp_path


@pytest.mark.parametrize(
    ("cell", "number"),
    [
        (Cell("figures", ("small", "ours"), "ms"), 1020.0),
        (Cell("figures", ("small", "ours"), "ms", section="Two"), 0.5),
        (Cell("figures", ("small", "theirs"), "ms"), 2.0),
        (Cell("figures", ("small",), "all"), 2.5),
    ],
)
def test_a_figure_is_the_first_number_of_its_cell(pages: Path, cell: Cell, number: float) -> None:
    assert cell.number(pages) == number


@pytest.mark.parametrize(
    "cell",
    [
        Cell("absent", ("small",), "ms"),
        Cell("figures", ("large",), "ms"),
        Cell("figures", ("small",), "µs"),
        Cell("figures", ("small", "ours"), "way"),
        Cell("figures", ("small",), "ms", section="Three"),
    ],
)
def test_a_figure_that_is_not_there_is_not_taken_for_one(pages: Path, cell: Cell) -> None:
    with pytest.raises(CellMissing):
        cell.number(pages)


def test_the_page_is_what_the_benchmarks_pages_say() -> None:
    assert (PAGES / "README.md").read_text(encoding="utf-8") == page(aims())


@pytest.mark.parametrize("aim", aims(), ids=lambda aim: aim.work)
def test_each_aim_has_one_limit(aim: Aim) -> None:
    assert (aim.at_most is None) != (aim.at_least is None)


@pytest.mark.parametrize(
    ("at_most", "at_least", "is_reached"),
    [(2.5, None, True), (2.4, None, False), (None, 2.5, True), (None, 2.6, False)],
)
def test_a_figure_is_held_against_its_limit(
    pages: Path, at_most: float | None, at_least: float | None, is_reached: bool
) -> None:
    aim = Aim("work", Cell("figures", ("small",), "all"), at_most=at_most, at_least=at_least)
    assert aim.shown(pages) == Shown("2.5", is_reached)


def test_an_aim_is_a_ratio_where_it_says_so(pages: Path) -> None:
    ours, theirs = (Cell("figures", ("small", name), "ms", "Two") for name in ("ours", "theirs"))
    assert Aim("work", ours, over=theirs, at_most=0.2).shown(pages) == Shown("0.25", False)


def test_what_no_page_shows_is_neither_reached_nor_missed(pages: Path) -> None:
    assert Aim("work", Cell("absent", ("small",), "ms"), at_most=1.0).shown(pages) is None

"""Tables: what fits stays on one line, what does not is folded, nothing is lost."""

from __future__ import annotations

import click
from hypothesis import given
from hypothesis import strategies as st

from nondum.cli.table import GAP, NARROWEST, cell, fitted, lines

TEXTS = st.text(st.characters(codec="ascii", exclude_categories=["C"]), max_size=60)


def plain(rows: list[dict[str, object]], columns: list[str], width: int | None) -> list[str]:
    return [click.unstyle(line) for line in lines(rows, columns, width=width)]


def test_long_cells_are_folded_under_their_column() -> None:
    rows: list[dict[str, object]] = [{"name": "eye", "why": "because it is plugged into this host"}]
    assert plain(rows, ["name", "why"], 26) == [
        "NAME  WHY",
        "eye   because it is",
        "      plugged into this",
        "      host",
    ]


def test_the_words_of_a_state_are_coloured_and_aligned() -> None:
    rows = [{"state": "refused", "n": 1}, {"state": "ready", "n": 2}]
    shown = lines(rows, ["state", "n"], width=None)
    assert shown[1] == click.style("refused", fg="red") + "  1"
    assert shown[2] == click.style("ready", fg="green") + "    2"


def test_cells_of_strangers_cannot_drive_a_terminal() -> None:
    assert cell("a\x1b]0;title\x07b\nc") == "a\\x1b]0;title\\x07b c"
    assert cell({"\x1b[2J": ["\x9b5m"]}) == "\\x1b[2J=\\x9b5m"


@given(st.lists(st.integers(1, 200), min_size=1, max_size=8), st.integers(1, 200))
def test_columns_fit_or_are_as_narrow_as_can_be(natural: list[int], width: int) -> None:
    widths = fitted(natural, width)
    assert all(w <= n for w, n in zip(widths, natural, strict=True))
    total = sum(widths) + GAP * (len(widths) - 1)
    assert total <= width or all(
        w == min(n, NARROWEST) for w, n in zip(widths, natural, strict=True)
    )


@given(st.lists(st.tuples(TEXTS, TEXTS), min_size=1, max_size=5), st.integers(20, 120))
def test_folding_loses_no_character(texts: list[tuple[str, str]], width: int) -> None:
    rows: list[dict[str, object]] = [{"a": a, "b": b} for a, b in texts]
    shown = sorted("".join(plain(rows, ["a", "b"], width)[1:]).replace(" ", ""))
    whole = sorted("".join(cell(a) + cell(b) for a, b in texts).replace(" ", ""))
    assert shown == whole

"""The tables that are kept of the grammar parse as those that lark makes of it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from lark import Lark, UnexpectedInput

from nondum.planning.pddl import tables
from nondum.planning.pddl.build import Builder

ROOT = Path(__file__).parents[2]
FRAGMENTS = sorted(
    path
    for folder in ("planning", "plugins", "examples")
    for path in (ROOT / folder).rglob("*.pddl")
    if "build" not in path.parts
)
COMMENT = re.compile(r";[^\n]*")


def grammar() -> str:
    return (tables.FOLDER / tables.GRAMMAR).read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def parsers() -> tuple[Lark, Lark]:
    """Of the kept tables, and of new ones."""
    return tables.parser_of(Builder()), Lark(
        grammar(),
        parser="lalr",
        start=["fragment", "formula", "signature"],
        maybe_placeholders=False,
        transformer=Builder(),
    )


def told(parser: Lark, text: str, start: str = "fragment") -> object:
    """What a parser makes of a text: what it builds, or where it stops and what it expected."""
    try:
        return parser.parse(text, start=start)
    except UnexpectedInput as error:
        return type(error), error.pos_in_stream, getattr(error, "expected", None)


def test_the_tables_are_of_this_grammar_and_this_lark() -> None:
    assert tables.are_current(), "python -m tests.docs.reference writes them"


@pytest.mark.parametrize("path", FRAGMENTS, ids=lambda path: path.parent.name)
def test_fragments_are_read_alike(parsers: tuple[Lark, Lark], path: Path) -> None:
    kept, new = parsers
    text = COMMENT.sub("", path.read_text(encoding="utf-8")).lower()
    assert told(kept, text) == told(new, text)


@pytest.mark.parametrize("path", FRAGMENTS, ids=lambda path: path.parent.name)
def test_texts_that_break_off_are_refused_alike(parsers: tuple[Lark, Lark], path: Path) -> None:
    kept, new = parsers
    text = COMMENT.sub("", path.read_text(encoding="utf-8")).lower()
    for end in [match.end() for match in re.finditer(r"\S+", text)][::7]:
        assert told(kept, text[:end]) == told(new, text[:end])


@pytest.mark.parametrize(
    ("start", "text"),
    [
        ("formula", "(and (at ?r ?x) (not (= ?x home)) (forall (?y - room) (or (dark ?y))))"),
        ("formula", "(and (at ?r"),
        ("signature", "(at ?r - robot ?x - (either room dock))"),
        ("signature", "(at ?r - "),
    ],
)
def test_parts_are_read_alike(parsers: tuple[Lark, Lark], start: str, text: str) -> None:
    kept, new = parsers
    assert told(kept, text, start) == told(new, text, start)


def test_tables_of_another_grammar_are_not_used(tmp_path: Path) -> None:
    (tmp_path / tables.TABLES).write_text(tables.made(), encoding="utf-8")
    changed = grammar().replace('?fragment: "("', '?fragment: "(" "("')
    assert changed != grammar()
    (tmp_path / tables.GRAMMAR).write_text(changed, encoding="utf-8")
    text = "((define (domain d))"
    with pytest.raises(UnexpectedInput):
        tables.parser_of(Builder()).parse(text, start="fragment")
    assert tables.parser_of(Builder(), tmp_path).parse(text, start="fragment")
